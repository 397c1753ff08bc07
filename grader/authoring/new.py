"""Start a new assignment: copy three commented files, all or none, never over existing ones.

The built-in assignments, and the mechanisms in the library's folder `starts`, are files with a comment at
each key. A copy keeps the comments; only the names in it, and the remarks at its top, are new.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from grader.authoring.from_mechanism import texts_for, with_forces
from grader.files import create_whole
from grader.rubric import load_rubric
from grader.texts.spoken import failure
from reference.authored.assignment import SUFFIXES, Assignment, library, load_assignment, locate, names_in
from reference.authored.toml_file import text_of
from reference.errors import CallError

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
HEADS = {
    "assignment": """\
# {what}
# Its mechanism is in {name}.mechanism.toml, its rubric in {name}.rubric.toml.
#   planmark plan {file} --svg plan.svg   draws a variant
#   planmark lint {file}   checks all three against every variant
""",
    "mechanism": "# The mechanism of {file}.\n",
    "rubric": "# The rubric of {file}. Strike out what you do not ask for; set the points.\n",
}


@dataclass(frozen=True, slots=True)
class New:
    """The files that were written."""

    assignment: Path
    mechanism: Path
    rubric: Path


def new_assignment(
    file: Path, *, like: str | None = None, mechanism: str | None = None, table: Path | None = None
) -> New:
    """Write a commented assignment, its mechanism and its rubric.

    Arguments
    ---------
    file : NAME, or a path that ends in NAME.toml or NAME.assignment.toml
    like : an assignment (a built-in name or a path) whose mechanism, data and rubric are copied;
        where its pages show force plans and its rubric asks for none, it gets criteria for what they show
    mechanism : one of `starts`, or the path of a mechanism's file, for which scales and rubric are made; the
        four-bar if neither is given
    table : the data of the variants, a CSV, for a mechanism's file

    Raises CallError if one of the files exists already, or a name is not known; AuthoredFileError if the
    files of `like` have faults.
    """
    if like is not None and mechanism is not None:
        raise failure(CallError, "like_or_mechanism", "unused_beside", option="--like", other="--mechanism")
    path, name = _path_and_name(file)
    if mechanism is not None and mechanism.endswith(".toml"):
        return _of_own_mechanism(path, name, Path(mechanism), table)
    if table is not None:
        raise failure(CallError, "option_unused", "table_unused")
    if like is not None:
        source = load_assignment(like)
        what = f"An assignment like {source.id}."
    else:
        source = load_start(mechanism or "four-bar")
        what = f"An assignment to start from: {source.mechanism_file.title.en}."
    texts = {
        kind: HEADS[kind].format(what=what, file=path.name, name=name) + text
        for kind, text in _renamed_texts(source, name).items()
    }
    beside = {kind: path.with_name(f"{name}{SUFFIXES[kind]}") for kind in ("mechanism", "rubric")}
    written = New(path, **beside)
    create_whole({getattr(written, kind): text for kind, text in texts.items()} | _table(source, path))
    return written


def _of_own_mechanism(path: Path, name: str, mechanism: Path, table: Path | None) -> New:
    """Write an assignment for a mechanism's file; copy it and the table if they are elsewhere."""
    start = load_start("four-bar")
    made = texts_for(mechanism, name, _renamed_texts(start, name), table)
    what = f"An assignment of {mechanism.name}, at the largest round scales that fit every variant."
    heads = {kind: head.format(what=what, file=path.name, name=name) for kind, head in HEADS.items()}
    written = New(path, *(path.with_name(f"{name}{SUFFIXES[kind]}") for kind in ("mechanism", "rubric")))
    texts = {getattr(written, kind): heads[kind] + text for kind, text in made.items()}
    copied = {} if table is None else {path.parent / table.name: table}
    for target, source in ({written.mechanism: mechanism} | copied).items():
        if target.resolve() != source.resolve():
            text = text_of(source)
            texts[target] = _renamed(text, {"id": name}) if target == written.mechanism else text
    create_whole(texts)
    return written


def _table(source: Assignment, path: Path) -> dict[Path, str]:
    """Return the CSV of the source's variants, which the copy names too; none if both use the same file."""
    table = source.file.variant.table
    if table is None or table.file is None:
        return {}
    own, copied = source.path.parent / table.file, path.parent / table.file
    return {} if own.resolve() == copied.resolve() else {copied: text_of(own)}


def _path_and_name(file: Path) -> tuple[Path, str]:
    """Return the assignment's file and its name."""
    name = file.name.removesuffix(".toml").removesuffix(".assignment")
    if not NAME.fullmatch(name):
        raise failure(CallError, "new_name", text=file.name)
    is_whole = file.name.endswith(".toml")
    return (file if is_whole else file.with_name(f"{name}{SUFFIXES['assignment']}")), name


def _renamed_texts(source: Assignment, name: str) -> dict[str, str]:
    """Return the source's three files under another name, without the remarks at their top."""
    asked = load_rubric(source.file.rubric, beside=source.path)
    text = source.path.read_text(encoding="utf-8")
    if isinstance(source.file.mechanism, str):
        mechanism = locate("mechanism", source.file.mechanism, source.path).read_text(encoding="utf-8")
    else:
        text, mechanism = _split(text)
    rubric = locate("rubric", source.file.rubric, source.path).read_text(encoding="utf-8")
    if source.forces and not any(one.section == "force_plans" for one in asked.criterion):
        rubric = with_forces(rubric, source)
    return {
        "assignment": _renamed(text, {"id": name, "mechanism": name, "rubric": name}),
        "mechanism": _renamed(mechanism, {"id": name}),
        "rubric": _renamed(rubric, {"id": name}),
    }


def _split(text: str) -> tuple[str, str]:
    """Split an assignment that holds its mechanism as tables `[mechanism...]` into the texts of two files."""
    parts = re.split(r"(?m)^(?=\[)", text)
    inside = [part for part in parts if re.match(r"\[\[?mechanism\b", part)]
    rest = "".join(part for part in parts if part not in inside)
    mechanism = re.sub(r"(?m)^(\[\[?)mechanism\.", r"\1", "".join(inside))
    return f'mechanism = ""\n{rest}', mechanism.replace("[mechanism]", "", 1).lstrip()


def _renamed(text: str, names: Mapping[str, str]) -> str:
    """Return a file's text with other names at its top-level keys; CallError if they cannot be replaced."""
    renamed = re.sub(r"\A(#.*\n|\s*\n)+", "", text)
    for key, name in names.items():
        line = rf"""(?m)^{key}\s*=\s*("[^"\n]*"|'[^'\n]*')"""
        renamed = re.sub(line, f'{key} = "{name}"', renamed, count=1)
    if tomllib.loads(renamed) != {**tomllib.loads(text), **names}:
        raise failure(CallError, "like_form", names=tuple(names))
    return renamed


# Mechanisms to start from: the library's folder `starts` ------------------------------------------


def starts_folder() -> Path:
    """Return the folder of the mechanisms to start from."""
    return library() / "starts"


def starts() -> list[str]:
    """Return the names of the mechanisms to start from."""
    return names_in(starts_folder(), "assignment")


def load_start(name: str) -> Assignment:
    """Load a mechanism to start from, as an assignment; CallError for an unknown name."""
    if name not in starts():
        raise failure(CallError, "unknown_mechanism", text=name, names=tuple(starts()))
    return load_assignment(starts_folder() / f"{name}{SUFFIXES['assignment']}")
