"""Arguments that name a class's folder, and the options that its `planmark.toml` gives."""

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from grader.cli.terminal import gettext, note
from grader.language import LANGUAGES, ROOT_LANGUAGE
from reference.errors import CallError

if TYPE_CHECKING:
    from grader.tables.class_file import ClassSettings

SETTINGS = "planmark.class_settings"
"""The key of a command's context for the settings that it found."""


def class_folder(context: typer.Context, folder: Path | None) -> Path | None:
    """The folder that is named, else the working folder; the options that are absent come from its file."""
    if context.resilient_parsing:
        return folder
    settings = _settings(context, (folder or Path(), *_above(folder)))
    if folder is None and settings is None:
        raise _unnamed("folder_unnamed")
    return folder or Path()


def class_results(context: typer.Context, folder: Path | None) -> Path | None:
    """The folder of results: the one that is named, or that of the class whose folder is named.

    A class is known by its `planmark.toml`: in the folder, in the working folder above it, or beside the
    submissions whose results these are.
    """
    if context.resilient_parsing:
        return folder
    places = [folder or Path(), *_above(folder)]
    if folder is not None and not (folder / "planmark.toml").is_file():
        from grader.folder.changes import noted_run

        with suppress(CallError):  # the command itself says what is missing
            places.append(noted_run(folder).folder)
    settings = _settings(context, places)
    if settings is None and folder is None:
        raise _unnamed("results_unnamed")
    is_class = settings is not None and settings.file.parent.resolve() == (folder or Path()).resolve()
    return settings.out if settings is not None and is_class and settings.out.is_dir() else folder or Path()


def _unnamed(cause: str) -> CallError:
    from grader.texts.spoken import failure

    return failure(CallError, "folder_unnamed", cause)


def language_of(arguments: Sequence[str]) -> str:
    """Return the language that a call or the class of the working folder names, before options are read."""
    text = " ".join(["", *arguments, "\n"])
    with suppress(OSError, ValueError):
        text += Path("planmark.toml").read_text("utf-8")
    found = re.search(r"""(?: --lang[= ]|^language *= *["'])(\w+)""", text, re.MULTILINE)
    return found[1] if found and found[1] in LANGUAGES else ROOT_LANGUAGE


def _above(folder: Path | None) -> list[Path]:
    """The working folder, where a named folder lies in it."""
    return [] if folder is None or not folder.resolve().is_relative_to(Path.cwd()) else [Path()]


def _settings(context: typer.Context, places: Iterable[Path]) -> "ClassSettings | None":
    """The settings of the first place that has a file, as defaults of the command's options."""
    file = next((place / "planmark.toml" for place in places if (place / "planmark.toml").is_file()), None)
    if file is None:
        return None
    from grader.lms.export import TARGETS
    from grader.tables.class_file import read_class_file

    settings = read_class_file(file, TARGETS)
    values = dict(settings.values)
    if context.info_name == "match":
        # Its --out is a roster.
        del values["out"]
    context.default_map = values
    context.meta[SETTINGS] = settings
    return settings


def tell_used(context: typer.Context) -> None:
    """Print in one line which options came from the class's file."""
    settings = context.meta.get(SETTINGS)
    if settings is None:
        return
    used = []
    for key, parameter in settings.keys.items():
        source = context.get_parameter_source(parameter)
        if source is not None and source.name == "DEFAULT_MAP":
            used.append(f"{key} {settings.values[parameter]}")
    note(f"{settings.file}: " + (", ".join(used) or gettext("no option is taken from it")))
