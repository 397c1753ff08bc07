"""Settings of the web application: from the command line, secrets from the environment."""

import os
import re
import secrets
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from grader.files import make_folder, write_whole
from grader.folder.workers import Limits
from grader.review.server import LOOPBACK
from grader.texts.spoken import failure
from reference.errors import CallError

SECRET = "PLANMARK_SECRET"  # noqa: S105 - the name of the variable
DATABASE = "PLANMARK_DATABASE"
MAIL = "PLANMARK_MAIL"
LEAST_SECRET = 32
"""Characters of the secret that signs links and forms: a shorter one could be found by trying."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a server.

    Attributes
    ----------
    data : the folder with all files
    database : SQLAlchemy's URL
    secret : signs personal links and forms; whoever has it can make them
    address : under which students reach it, such as ``https://marks.example.org``; a cookie is for https
        alone where this is https
    jobs, limits : worker processes of a class that is graded, and what a file may take in one
    photos : photos that are checked at once, each in a process with these limits
    upload_mb, photo_mb : what a file of a class, and a photo, may have
    student_pages, class_pages : that a student may hand in, and all students of a class together
    upload_pages : of all files of a class, with those that instructors upload
    photo_pages : of a file that is checked
    sender_seconds : in an hour, of checking one person's photos and of counting the pages of their files
    class_seconds : of those of all without a personal link together
    keep_days : how long visits, photos' results and the audit trail are kept
    link_days : how long a personal link is valid
    mail : the server of e-mail and the sender, ``smtps://USER:PASSWORD@HOST/SENDER``; empty without one
    """

    data: Path
    database: str
    secret: str = field(repr=False)
    address: str = "http://127.0.0.1:8000"
    jobs: int = 1
    limits: Limits = field(default_factory=Limits)
    photos: int = 1
    upload_mb: int = 200
    photo_mb: int = 30
    student_pages: int = 40
    class_pages: int = 4000
    upload_pages: int = 10_000
    photo_pages: int = 10
    sender_seconds: float = 300.0
    class_seconds: float = 3600.0
    keep_days: float = 365.0
    link_days: float = 200.0
    mail: str = field(default="", repr=False)

    @property
    def is_https(self) -> bool:
        """True if cookies are sent over https alone."""
        return self.address.startswith("https://")

    @property
    def is_local(self) -> bool:
        """True if only this machine is served."""
        return urlsplit(self.address).hostname in LOOPBACK

    @property
    def host(self) -> str:
        """The name and port that a request must be for."""
        return urlsplit(self.address).netloc

    def without_folder(self, text: str) -> str:
        """Return a message for people elsewhere, without the path of the data folder."""
        text = text.replace(f"{self.data.resolve()}{os.sep}", "").replace(f"{self.data}{os.sep}", "")
        return re.sub(r"publications/[\w-]+/exports/\w+/given/", "", text)


def settings_of(
    data: Path, address: str, database: str | None = None, mail: str | None = None, *, jobs: int = 1
) -> Settings:
    """Return the settings of a data folder; its secret is made once, if the environment has none.

    Raises CallError for an address or a mail server that is none and for a short secret, OutputError where
    the folder cannot be written.
    """
    parts = urlsplit(address)
    if parts.scheme not in {"http", "https"} or not parts.netloc or parts.path.strip("/"):
        raise failure(CallError, "address", address=address)
    make_folder(data)
    url = database or os.environ.get(DATABASE) or f"sqlite:///{data.resolve() / 'planmark.sqlite'}"
    photos = max(1, (os.cpu_count() or 1) - 1)
    mail = _mail(mail or os.environ.get(MAIL, ""))
    return Settings(data, url, _secret(data), address.rstrip("/"), jobs=jobs, photos=photos, mail=mail)


def _mail(url: str) -> str:
    with suppress(ValueError):
        parts = urlsplit(url)
        is_port = parts.port != 0  # raises where it is no number
        if not url or (
            parts.scheme in {"smtp", "smtps"} and parts.hostname and "@" in parts.path and is_port
        ):
            return url
    raise failure(CallError, "mail")


def _secret(data: Path) -> str:
    given = os.environ.get(SECRET, "")
    if given:
        if len(given) < LEAST_SECRET:
            raise failure(CallError, "secret_short", option=SECRET, least=LEAST_SECRET)
        return given
    path = data / "secret"
    if not path.is_file():
        write_whole(path, secrets.token_urlsafe(48))
        path.chmod(0o600)
    return path.read_text(encoding="utf-8")
