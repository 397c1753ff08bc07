"""Output on the terminal and in the log: notes, the next step, progress in a pipe."""

import logging
import os
import platform
import shlex
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import typer

from grader import __version__
from grader.files import in_one_line, log_to
from grader.language import N_, ROOT_LANGUAGE, Tongue, tongue

LOG = logging.getLogger("planmark")
INTERRUPTED = 130
"""The exit status of a program that Ctrl+C ended, as shells count: 128 and the signal's number."""


_SPEAKERS = [tongue(ROOT_LANGUAGE)]


def speak(lang: str) -> str:
    """Print in a language from now on, and return its code; raises CallError for one that is not known."""
    _SPEAKERS[:] = [tongue(lang)]
    return _SPEAKERS[0].lang


def speaker() -> Tongue:
    """Return the language of this call."""
    return _SPEAKERS[0]


def gettext(text: str, /, **said: object) -> str:
    """Return a text in the language of this call, filled in."""
    return speaker().gettext(text) % said


def unit(name: str) -> str:
    """Return a unit in the letters of the language of this call."""
    return speaker().unit(name)


def named(numbers: Mapping[str, int]) -> str:
    """Name the variant with these numbers in the language of this call: ``n = 7, position = 2``."""
    return ", ".join(f"{gettext(key)} = {one}" for key, one in numbers.items()) or gettext("the only variant")


class _Screen(logging.Handler):
    """Notes on standard output, details on standard error."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record."""
        say(self.format(record), err=record.levelno < logging.INFO)


_SCREEN = _Screen(logging.INFO)
LOG.setLevel(logging.INFO)
LOG.addHandler(_SCREEN)


def set_up(*, quiet: bool, verbose: bool, log: Path | None) -> None:
    """Say what is shown and logged from now on; raises OutputError for a log that cannot be written."""
    level = logging.WARNING if quiet else logging.INFO
    _SCREEN.setLevel(logging.DEBUG if verbose else level)
    for handler in set(LOG.handlers) - {_SCREEN}:
        LOG.removeHandler(handler)
        handler.close()
    LOG.setLevel(logging.DEBUG if verbose or log else level)
    LOG.propagate = False
    if log is not None:
        log_to(log)


def is_quiet() -> bool:
    """Return whether notes and progress are not wanted."""
    return _SCREEN.level > logging.INFO


def shown(text: str) -> str:
    """The text with escapes for the signs that a terminal would obey: names of files may have them."""
    return "\n".join(map(in_one_line, text.split("\n")))


def say(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Print a text."""
    typer.echo(shown(text), err=err, nl=nl)


def note(text: str) -> None:
    """Print what `--quiet` leaves out."""
    LOG.info("%s", text)


def note_call() -> None:
    """Log the versions, and how the program was called."""
    if not LOG.isEnabledFor(logging.DEBUG):
        return  # to find the system's version takes longer than to solve a mechanism
    system = f"Python {platform.python_version()}, {platform.platform()}"
    LOG.debug("planmark %s, %s, in %s", __version__, system, Path.cwd())
    LOG.debug("%s", shown_command("planmark", *sys.argv[1:]))


def tell_next(*command: object, before: str = "%(command)s") -> None:
    """Print the command that comes next, in the text of what is to be done before it."""
    note(gettext("next: %(text)s", text=gettext(before, command=shown_command("planmark", *command))))


def shown_command(*words: object) -> str:
    """A command as it can be typed into this system's shell."""
    texts = [str(word) for word in words]
    return subprocess.list2cmdline(texts) if os.name == "nt" else shlex.join(texts)


def color() -> bool | None:
    """False where NO_COLOR asks for none (https://no-color.org); else None: as the terminal is."""
    return False if os.environ.get("NO_COLOR") else None


def set_encoding() -> None:
    """Write UTF-8, or the encoding that PYTHONIOENCODING names with escapes for what it does not have."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure and os.environ.get("PYTHONIOENCODING"):
            reconfigure(errors="backslashreplace")
        elif reconfigure:
            reconfigure(encoding="utf-8", errors="replace")


WORK = {
    "solver": N_("solver"), "reading": N_("reading"), "drawings": N_("drawings"), "opening": N_("opening"),
    "looking": N_("looking"), "marking": N_("marking"), "sent": N_("sent"),
}  # fmt: skip
"""Kinds of work, as progress names them."""


class Pace:
    """The pace of each kind of work, and the time left; work that a run finds done does not count."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[float, int]] = {}

    def __call__(self, what: str, done: int, total: int) -> str:
        """``24 a minute, 2 h 05 min left``; empty before anything is known of it, and at the end."""
        now = time.monotonic()
        began, before = self._first.setdefault(what, (now, done))
        if done <= before or now - began < _LEAST_S or done >= total:
            return ""
        a_second = (done - before) / (now - began)
        minutes, seconds = divmod(round((total - done) / a_second), 60)
        hours, minutes = divmod(minutes, 60)
        left = f"{hours} h {minutes:02d} min" if hours else f"{minutes} min" if minutes else f"{seconds} s"
        return gettext("%(count).0f a minute, %(left)s left", count=60.0 * a_second, left=left)


_LEAST_S = 1.0
"""Shortest time from which a pace is stated: the first results come together."""


class StepLines:
    """Progress as lines for a pipe or a file: now and then, and when a kind of work is done."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._last = seconds, time.monotonic()
        self._done: dict[str, int] = {}
        self._pace = Pace()

    def __call__(self, what: str, done: int, total: int) -> None:
        """Tell how much of a kind of work is done, if it is time."""
        is_end = done >= total and self._done.get(what) != done
        pace = self._pace(what, done, total)
        self._done[what] = done
        if is_end or time.monotonic() - self._last >= self._seconds:
            self._last = time.monotonic()
            if not is_quiet():
                typer.echo(f"{gettext(WORK[what])}: {done} / {total}{', ' if pace else ''}{pace}", err=True)
