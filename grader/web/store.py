"""The database of the web application: accounts, publications, jobs, links, requests, audit.

What people hand in, and results, are files (`grader.web.places`). Times are seconds since 1970, UTC.
"""

import hashlib
import secrets
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from sqlalchemy import (
    JSON,
    ForeignKey,
    String,
    UniqueConstraint,
    create_engine,
    delete,
    event,
    inspect,
    select,
    text,
    update,
)
from sqlalchemy.engine import Engine, make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column, relationship, sessionmaker
from sqlalchemy.schema import CreateColumn

from grader.texts.spoken import failure
from reference.errors import CallError

KEY_BYTES = 9
"""Bytes of a publication's key: 72 random bits cannot be guessed, and 12 letters can be typed."""


def new_key() -> str:
    """Return a random name for an address."""
    return secrets.token_urlsafe(KEY_BYTES)


def digest_of(token: str) -> str:
    """Return the digest of a secret, which is stored: whoever reads the data base cannot use it."""
    return hashlib.sha256(token.encode()).hexdigest()


class Table(DeclarativeBase):
    """The base of all tables."""

    type_annotation_map = {dict[str, Any]: JSON, list[Any]: JSON}  # noqa: RUF012 - as SQLAlchemy wants it


class Account(Table):
    """An instructor.

    Attributes
    ----------
    password : an Argon2 hash, empty until an invitation is answered
    totp : the secret of the second factor, empty without one
    totp_used : the last step of time of which a code was taken
    email : in small letters, for a link to a new password; empty where none was given
    """

    __tablename__ = "accounts"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(80), unique=True)
    password: Mapped[str] = mapped_column(String(200), default="")
    is_admin: Mapped[bool] = mapped_column(default=False)
    created: Mapped[float] = mapped_column(default=time.time)
    totp: Mapped[str] = mapped_column(String(64), default="", server_default="")
    totp_used: Mapped[int] = mapped_column(default=0, server_default="0")
    email: Mapped[str] = mapped_column(String(200), default="", server_default="", index=True)


class Visit(Table):
    """A browser's session, or a program's token; `id` is the digest of its secret."""

    __tablename__ = "visits"
    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    account_id: Mapped[int | None] = mapped_column(ForeignKey("accounts.id", ondelete="CASCADE"))
    account: Mapped[Account | None] = relationship(lazy="joined")
    title: Mapped[str] = mapped_column(String(80), default="")
    """The name of a program's token; empty for a browser."""
    links: Mapped[dict[str, Any]] = mapped_column(default=dict)
    """Personal links that were opened in it: the link's id by the publication's."""
    created: Mapped[float] = mapped_column(default=time.time)
    used: Mapped[float] = mapped_column(default=time.time)


class Publication(Table):
    """An assignment published to a group of students.

    Attributes
    ----------
    assignment : a built-in name, or the name of an uploaded file
    level : of hints in a self-check
    attempts : allowed for each student and variant; None for any number
    is_open, is_released : whether students may check, and whether they see their feedback
    takes_sheets : whether students may hand in sheets by their personal links
    deadline, release_at : until when they may, and from when they see feedback that is released
    """

    __tablename__ = "publications"
    id: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(String(20), unique=True, default=new_key)
    title: Mapped[str] = mapped_column(String(120), default="")
    term: Mapped[str] = mapped_column(String(40), default="", index=True)
    assignment: Mapped[str] = mapped_column(String(120), default="")
    lang: Mapped[str] = mapped_column(String(2), default="en")
    level: Mapped[str] = mapped_column(String(10), default="hint")
    attempts: Mapped[int | None] = mapped_column(default=None)
    is_open: Mapped[bool] = mapped_column(default=False)
    is_released: Mapped[bool] = mapped_column(default=False)
    takes_sheets: Mapped[bool] = mapped_column(default=False)
    pages_per_student: Mapped[int | None] = mapped_column(default=None)
    created: Mapped[float] = mapped_column(default=time.time)
    deadline: Mapped[float | None] = mapped_column(default=None)
    release_at: Mapped[float | None] = mapped_column(default=None)
    members: Mapped[list[Account]] = relationship(secondary="members", lazy="selectin")

    @property
    def is_over(self) -> bool:
        """True after the deadline."""
        return self.deadline is not None and self.deadline < time.time()

    @property
    def shows_feedback(self) -> bool:
        """True if students see their feedback now."""
        return self.is_released and (self.release_at or 0.0) <= time.time()


class Member(Table):
    """An instructor's access to a publication; one that a launch gave ends with its `platform_id`."""

    __tablename__ = "members"
    publication_id: Mapped[int] = mapped_column(
        ForeignKey("publications.id", ondelete="CASCADE"), primary_key=True
    )
    account_id: Mapped[int] = mapped_column(ForeignKey("accounts.id", ondelete="CASCADE"), primary_key=True)
    platform_id: Mapped[int | None] = mapped_column(ForeignKey("lti_platforms.id", ondelete="CASCADE"))


class Link(Table):
    """A student's personal link; `secret` signs it, and a revoked one is never opened again."""

    __tablename__ = "links"
    id: Mapped[int] = mapped_column(primary_key=True)
    publication_id: Mapped[int] = mapped_column(ForeignKey("publications.id", ondelete="CASCADE"), index=True)
    publication: Mapped[Publication] = relationship(lazy="joined")
    student_id: Mapped[str] = mapped_column(String(80), index=True)
    expires: Mapped[float]
    is_revoked: Mapped[bool] = mapped_column(default=False)
    created: Mapped[float] = mapped_column(default=time.time)
    claim_id: Mapped[int | None] = mapped_column(ForeignKey("lti_claims.id", ondelete="SET NULL"))
    """The claim by which a launch gave the link."""

    @property
    def is_valid(self) -> bool:
        """True until the link expires or is revoked."""
        return not self.is_revoked and self.expires >= time.time()


class Sheet(Table):
    """A file that was handed in; a student's version, whose row outlives it, so that no name is given twice.

    Attributes
    ----------
    student_id : empty for what an instructor uploaded
    file : the name under which it is stored
    shown : the person's own name of it, for people alone
    pages : that count for the budgets of the student and of the class
    """

    __tablename__ = "sheets"
    __table_args__ = (UniqueConstraint("publication_id", "file"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    publication_id: Mapped[int] = mapped_column(ForeignKey("publications.id", ondelete="CASCADE"), index=True)
    student_id: Mapped[str] = mapped_column(String(80), index=True)
    file: Mapped[str] = mapped_column(String(120))
    shown: Mapped[str] = mapped_column(String(200), default="")
    pages: Mapped[int] = mapped_column(default=1)
    sent: Mapped[float] = mapped_column(default=time.time)


class Attempt(Table):
    """The number of times that a student has checked a variant."""

    __tablename__ = "attempts"
    __table_args__ = (UniqueConstraint("publication_id", "who", "variant"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    publication_id: Mapped[int] = mapped_column(ForeignKey("publications.id", ondelete="CASCADE"), index=True)
    who: Mapped[str] = mapped_column(String(100))
    """``student:ID`` of a personal link."""
    variant: Mapped[str] = mapped_column(String(60))
    count: Mapped[int] = mapped_column(default=0)


class Job(Table):
    """Something that takes longer than a request: grading a class, checking a photo."""

    __tablename__ = "jobs"
    id: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(String(20), unique=True, default=new_key)
    publication_id: Mapped[int] = mapped_column(ForeignKey("publications.id", ondelete="CASCADE"), index=True)
    publication: Mapped[Publication] = relationship(lazy="joined")
    kind: Mapped[str] = mapped_column(String(10))
    """``grade``, ``photo``, or ``count`` of the pages of a file that was sent."""
    state: Mapped[str] = mapped_column(String(10), default="queued", index=True)
    """``queued``, ``running``, ``done``, ``failed`` or ``cancelled``."""
    asked: Mapped[dict[str, Any]] = mapped_column(default=dict)
    result: Mapped[dict[str, Any]] = mapped_column(default=dict)
    message: Mapped[str] = mapped_column(default="")
    stage: Mapped[str] = mapped_column(String(40), default="")
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int] = mapped_column(default=0)
    visit_id: Mapped[str] = mapped_column(String(64), default="")
    """The visit that sent the photo."""
    sender: Mapped[str] = mapped_column(String(100), default="", server_default="")
    """Charged with its seconds: ``student:ID`` of a personal link, ``account:ID``, else ``visit:ID``."""
    created: Mapped[float] = mapped_column(default=time.time)
    started: Mapped[float | None] = mapped_column(default=None)
    ended: Mapped[float | None] = mapped_column(default=None)


class Regrading(Table):
    """A student's request to look again at a mark; `criterion` is empty for the whole submission."""

    __tablename__ = "regrading"
    id: Mapped[int] = mapped_column(primary_key=True)
    publication_id: Mapped[int] = mapped_column(ForeignKey("publications.id", ondelete="CASCADE"), index=True)
    student_id: Mapped[str] = mapped_column(String(80), index=True)
    position: Mapped[int | None] = mapped_column(default=None)
    criterion: Mapped[str] = mapped_column(String(80), default="")
    text: Mapped[str] = mapped_column(default="")
    answer: Mapped[str] = mapped_column(default="")
    created: Mapped[float] = mapped_column(default=time.time)
    answered: Mapped[float | None] = mapped_column(default=None)


class LtiPlatform(Table):
    """A learning platform from which people come; addresses as `grader.web.lti.Platform` has them."""

    __tablename__ = "lti_platforms"
    __table_args__ = (UniqueConstraint("issuer", "client_id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    issuer: Mapped[str] = mapped_column(String(500))
    client_id: Mapped[str] = mapped_column(String(200))
    auth_login_url: Mapped[str] = mapped_column(String(500))
    auth_token_url: Mapped[str] = mapped_column(String(500))
    key_set_url: Mapped[str] = mapped_column(String(500))
    deployments: Mapped[list[Any]]


class LtiUser(Table):
    """Somebody who came from a platform; an instructor has an account.

    Attributes
    ----------
    students : as older versions kept what is now `LtiClaim`
    """

    __tablename__ = "lti_users"
    __table_args__ = (UniqueConstraint("platform_id", "subject"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    platform_id: Mapped[int] = mapped_column(ForeignKey("lti_platforms.id", ondelete="CASCADE"))
    subject: Mapped[str] = mapped_column(String(255))
    account_id: Mapped[int | None] = mapped_column(ForeignKey("accounts.id", ondelete="SET NULL"))
    account: Mapped[Account | None] = relationship(lazy="joined")
    students: Mapped[dict[str, Any]] = mapped_column(default=dict)


class LtiClaim(Table):
    """A platform user's claim to be a student of a roster; of several users one `holds` it.

    Attributes
    ----------
    who : name and e-mail as the platform says them, for the instructor who decides
    """

    __tablename__ = "lti_claims"
    __table_args__ = (UniqueConstraint("publication_id", "user_id", "student_id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    publication_id: Mapped[int] = mapped_column(ForeignKey("publications.id", ondelete="CASCADE"), index=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("lti_users.id", ondelete="CASCADE"), index=True)
    student_id: Mapped[str] = mapped_column(String(80))
    who: Mapped[str] = mapped_column(String(200), default="")
    holds: Mapped[bool] = mapped_column(default=False)
    created: Mapped[float] = mapped_column(default=time.time)


class LtiActivity(Table):
    """An activity of a platform's course, what it shows, and where its grades go.

    Attributes
    ----------
    grades : the platform's claim on its grade service
    sent : digests of the grades that it has taken, by student
    """

    __tablename__ = "lti_activities"
    __table_args__ = (UniqueConstraint("platform_id", "deployment", "resource_link"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    platform_id: Mapped[int] = mapped_column(ForeignKey("lti_platforms.id", ondelete="CASCADE"))
    deployment: Mapped[str] = mapped_column(String(200))
    resource_link: Mapped[str] = mapped_column(String(255))
    publication_id: Mapped[int | None] = mapped_column(ForeignKey("publications.id", ondelete="SET NULL"))
    grades: Mapped[dict[str, Any]] = mapped_column(default=dict)
    sent: Mapped[dict[str, Any]] = mapped_column(default=dict)


class LtiState(Table):
    """A launch that has begun, or what an instructor is asked about; good for minutes, and once."""

    __tablename__ = "lti_states"
    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    expires: Mapped[float]
    what: Mapped[dict[str, Any]] = mapped_column(default=dict)


class Audit(Table):
    """An entry of the audit trail: who did what, and when. It stays until it is too old to be kept.

    Attributes
    ----------
    before, after : of a mark that was changed
    """

    __tablename__ = "audit"
    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[float] = mapped_column(default=time.time, index=True)
    who: Mapped[str] = mapped_column(String(100))
    act: Mapped[str] = mapped_column(String(40))
    about: Mapped[str] = mapped_column(String(200), default="")
    before: Mapped[str] = mapped_column(String(200), default="", server_default="")
    after: Mapped[str] = mapped_column(String(200), default="", server_default="")


UNFINISHED = frozenset({"queued", "running"})
"""States of a job that waits or runs."""
CONNECTIONS = 60
"""More than the threads that may want one: 40 that answer requests, the queue's, the server's own."""


def last_job(session: Session, publication: Publication) -> Job | None:
    """Return the last job that graded the class."""
    own = select(Job).where(Job.publication_id == publication.id, Job.kind == "grade")
    return session.scalar(own.order_by(Job.id.desc()).limit(1))


def unanswered(session: Session, publication: Publication) -> Sequence[Regrading]:
    """Return the students' requests for regrading that nobody has answered."""
    own = select(Regrading).where(Regrading.publication_id == publication.id, Regrading.answered.is_(None))
    return session.scalars(own).all()


def columns_of(row: Table, *names: str) -> dict[str, Any]:
    """Return some columns of a row by name, as JSON."""
    return {name: getattr(row, name) for name in names}


class Store:
    """The data base.

    Arguments: `url` is SQLAlchemy's, ``sqlite:///FILE`` or ``postgresql+psycopg://USER@HOST/NAME``.

    Raises CallError for an address that is none, or that cannot be opened.
    """

    def __init__(self, url: str) -> None:
        try:
            self.engine = _engine(url)
            Table.metadata.create_all(self.engine)
            _add_columns(self.engine)
        except (ArgumentError, ImportError, SQLAlchemyError) as error:
            why = str(getattr(error, "orig", None) or error).splitlines()[0]
            raise failure(CallError, "data_base", error=why) from error
        self._sessions = sessionmaker(self.engine, expire_on_commit=False)
        with self.session() as session:
            _take_over(session)

    def close(self) -> None:
        """Close the connections that nobody uses."""
        self.engine.dispose()

    @contextmanager
    def session(self) -> Iterator[Session]:
        """A session that is committed at its end, and rolled back on any error."""
        with self._sessions() as session:
            yield session
            session.commit()

    def note(self, session: Session, who: str, act: str, about: str = "", change: Sequence[str] = ()) -> None:
        """Add to the audit trail; `change` are a mark before and after."""
        before, after = (*change, "", "")[:2]
        session.add(Audit(who=who[:100], act=act, about=about[:200], before=before[:200], after=after[:200]))

    def note_mark(self, key: str, who: str, about: str, before: str, after: str) -> None:
        """Add a changed mark of a publication to the audit trail."""
        with self.session() as session:
            self.note(session, who, "mark changed", f"{key} {about}", (before, after))

    def change_job(self, job_id: int, before: Collection[str], **values: object) -> bool:
        """Change a job whose state is one of `before`; return whether it was."""
        with self.session() as session:
            own = update(Job).where(Job.id == job_id, Job.state.in_(before))
            return bool(session.execute(own.values(**values)).rowcount)  # type: ignore[attr-defined]

    def forget(self, *, days: float) -> None:
        """Delete visits and audit entries older than so many days, and what photos gave a day ago."""
        now = time.time()
        before = now - days * 86400.0
        with self.session() as session:
            session.execute(delete(Visit).where(Visit.used < before, Visit.title == ""))
            session.execute(delete(Job).where(Job.created < now - 86400.0, Job.kind != "grade"))
            session.execute(delete(Audit).where(Audit.at < before))


def _add_columns(engine: Engine) -> None:
    """Add what tables of an older version lack: columns that may be empty, or have a default there."""
    with engine.begin() as connection:
        known = inspect(connection)
        for table in Table.metadata.sorted_tables:
            there = {column["name"] for column in known.get_columns(table.name)}
            for column in table.columns:
                if column.name not in there:
                    made = CreateColumn(column).compile(dialect=engine.dialect)
                    connection.execute(text(f"ALTER TABLE {table.name} ADD COLUMN {made}"))


def _take_over(session: Session) -> None:
    """Take over what an older version kept of launches: who is which student, and who became a member.

    A student as whom several came is nobody's until the instructor decides, and the links end.
    """
    there = set(session.scalars(select(Publication.id)))
    came: dict[tuple[int, str], list[LtiUser]] = {}
    for user in session.scalars(select(LtiUser)):
        for number, student in user.students.items():
            if int(number) in there:
                came.setdefault((int(number), student), []).append(user)
        user.students = {}
    for (publication, student), users in came.items():
        own = {"publication_id": publication, "student_id": student}
        is_one = len(users) == 1
        session.add_all(
            LtiClaim(**own, user_id=user.id, who=user.subject[:200], holds=is_one) for user in users
        )
        if not is_one:
            session.execute(update(Link).filter_by(**own).values(is_revoked=True))
    joined = (
        select(Member, LtiUser.platform_id)
        .join(LtiUser, LtiUser.account_id == Member.account_id)
        .join(Account, Account.id == Member.account_id)
        .join(Publication, Publication.id == Member.publication_id)
        .join(Audit, (Audit.who == Account.name) & (Audit.about == Publication.key + " " + Account.name))
        .where(Member.platform_id.is_(None), Audit.act == "member added")
    )
    for member, platform in session.execute(joined):
        member.platform_id = platform


def _engine(url: str) -> Engine:
    parts = make_url(url)
    is_sqlite = parts.get_backend_name() == "sqlite"
    if is_sqlite and parts.database in {None, "", ":memory:"}:
        raise ArgumentError("one in memory would be gone with the server: name a file, sqlite:///FILE")
    engine = create_engine(
        url, pool_size=CONNECTIONS, max_overflow=0, pool_pre_ping=not is_sqlite,
        connect_args={"timeout": 30.0} if is_sqlite else {},
    )  # fmt: skip
    if is_sqlite:

        @event.listens_for(engine, "connect")
        def _prepare(connection: Any, _record: object) -> None:  # noqa: ANN401 - the driver's own
            connection.execute("PRAGMA journal_mode=WAL")
            connection.execute("PRAGMA foreign_keys=ON")
            connection.execute("PRAGMA synchronous=FULL")

    return engine
