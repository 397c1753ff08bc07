"""Writing a new assignment: its three files, whole or not at all, never over others."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

from grader.authoring.explained import TABLES
from grader.authoring.rubric import rubric_for
from grader.authoring.starts import load_start
from grader.authoring.toml import commented
from grader.files import create_whole
from grader.rubric import RubricFile, load_rubric
from reference.assignment import SUFFIXES, Assignment, load_assignment
from reference.assignment_file import TRADITIONS, AssignmentFile
from reference.authored import validate
from reference.errors import CallError
from reference.mechanism_file import MechanismFile

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
GROUPS = (
    "DyadTable", "SliderTable", "SlottedLinkTable", "CrossSliderTable", "YokeTable",
    "PlateTable", "PointOnLineTable", "PointTable",
)  # fmt: skip
HEADS = {
    "assignment": (
        "{what}\n"
        "Its mechanism is in {name}.mechanism.toml, its rubric in {name}.rubric.toml.\n"
        "  planmark plan {file} --svg plan.svg   draws a variant\n"
        "  planmark lint {file}   holds all three against every variant"
    ),
    "mechanism": "The mechanism of {file}.",
    "rubric": "The rubric of {file}. Strike out what you do not ask for; set the points.",
}


@dataclass(frozen=True, slots=True)
class New:
    """What was written."""

    assignment: Path
    mechanism: Path
    rubric: Path


def new_assignment(file: Path, *, like: str | None = None, mechanism: str | None = None) -> New:
    """Write a commented assignment, its mechanism and its rubric.

    Arguments
    ---------
    file : NAME, or a path that ends in NAME.toml or NAME.assignment.toml
    like : an assignment (a built-in name or a path) whose mechanism, data and rubric are taken
    mechanism : one of `starts`, with a rubric made from its construction; neither: a four-bar

    Raises CallError where one of the files is there already, or a name is not known.
    """
    if like is not None and mechanism is not None:
        raise CallError("like_or_mechanism", "--like and --mechanism both say what to start from: give one")
    path, name = _named(file)
    if like is not None:
        source = load_assignment(like)
        rubric = load_rubric(source.file.rubric, beside=source.path)
        what = f"An assignment like {source.id}."
    else:
        source = load_start(mechanism or "four-bar")
        rubric = _generated(source, name)
        what = f"An assignment to start from: {source.mechanism_file.title.en}."
    texts = _texts(source, rubric, name, path.name, what)
    written = New(
        path, path.with_name(f"{name}{SUFFIXES['mechanism']}"), path.with_name(f"{name}{SUFFIXES['rubric']}")
    )
    create_whole(
        {
            written.assignment: texts["assignment"],
            written.mechanism: texts["mechanism"],
            written.rubric: texts["rubric"],
        }
    )
    return written


def _named(file: Path) -> tuple[Path, str]:
    """The assignment's file and its name."""
    name = file.name.removesuffix(".toml").removesuffix(".assignment")
    if not NAME.fullmatch(name):
        raise CallError("new_name", f"'{file.name}': a name of letters, digits, ., _ or - is needed")
    is_whole = file.name.endswith(".toml")
    return (file if is_whole else file.with_name(f"{name}{SUFFIXES['assignment']}")), name


def _generated(source: Assignment, name: str) -> RubricFile:
    mechanism = source.mechanism(source.variants()[:1])
    by_similarity = source.file.plate_images == "similarity"
    return rubric_for(name, source.file.title, mechanism, by_similarity=by_similarity)


def _texts(source: Assignment, rubric: RubricFile, name: str, file: str, what: str) -> dict[str, str]:
    """The files' texts, read again: what is written can be loaded."""
    # The tradition gives its names by itself.
    school = TRADITIONS.get(source.file.tradition, {})
    names = {key: shown for key, shown in source.file.names.items() if school.get(key) != shown}
    changed = {"id": name, "mechanism": name, "rubric": name, "names": names}
    heads = {kind: head.format(what=what, file=file, name=name) for kind, head in HEADS.items()}
    texts = {
        "assignment": commented(
            source.file.model_copy(update=changed),
            heads["assignment"],
        ),
        "mechanism": commented(source.mechanism_file.model_copy(update={"id": name}), heads["mechanism"])
        + _other_groups(source.mechanism_file),
        "rubric": commented(rubric.model_copy(update={"id": name}), heads["rubric"]),
    }
    for kind, model in (("assignment", AssignmentFile), ("mechanism", MechanismFile), ("rubric", RubricFile)):
        validate(model, tomllib.loads(texts[kind]), f"{name}{SUFFIXES[kind]}")
    return texts


def _other_groups(mechanism: MechanismFile) -> str:
    """What else may stand in a mechanism."""
    used = {type(group).__name__ for group in mechanism.group}
    told = [f"#   {TABLES[kind]}" for kind in GROUPS if kind not in used]
    lines = ["", "# Other kinds of groups, whose keys `planmark schema mechanism` lists:", *told]
    return "\n".join(lines) + "\n"
