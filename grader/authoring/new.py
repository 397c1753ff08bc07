"""A new assignment to start from: three commented files, written whole or not at all, never over others."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.authoring.comments import TABLES, commented
from grader.files import create_whole
from grader.rubric import CriterionTable, HandTable, RubricFile, ToleranceTable, load_rubric
from reference.assignment import SUFFIXES, Assignment, library, load_assignment
from reference.assignment_file import TRADITIONS, AssignmentFile
from reference.authored import Text, validate
from reference.construction import Construction, Vector
from reference.derivation import construction_of
from reference.errors import CallError
from reference.mechanism import Mechanism, Plate
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
POINTS = {"v": 2.0, "a": 2.0, "n": 2.0, "t": 1.0, "c": 2.0, "r": 1.0}
"""Of a velocity, of an acceleration, and of its parts."""
POINTS_OF_RESULT = 3.0
"""Of velocity and acceleration of the joint that the mechanism is there for: the last group's."""
POINTS_OF_SCALE, POINTS_OF_RATE, POINTS_OF_WAY, POINTS_OF_LINK = 1.0, 0.5, 0.5, 0.5
"""Of a scale, of an angular quantity, of a vector that is one way of two to draw a plate's image, and of
a link of the sketch."""

SCALES = {
    "kL": ("Scale of lengths", "Scara lungimilor", "Масштаб длин"),
    "kv": ("Scale of velocities", "Scara vitezelor", "Масштаб скоростей"),
    "ka": ("Scale of accelerations", "Scara accelerațiilor", "Масштаб ускорений"),
}
LINK = ("Link {} on the sketch", "Elementul {} al schiței", "Звено {} на схеме")
RATES = {
    "omega": (
        "Angular velocity of link {}",
        "Viteza unghiulară a elementului {}",
        "Угловая скорость звена {}",
    ),
    "epsilon": (
        "Angular acceleration of link {}",
        "Accelerația unghiulară a elementului {}",
        "Угловое ускорение звена {}",
    ),
}
VECTORS = {
    "v": ("Velocity of {}", "Viteza punctului {}", "Скорость точки {}"),
    "a": ("Acceleration of {}", "Accelerația punctului {}", "Ускорение точки {}"),
    "n": ("Normal acceleration of {}", "Accelerația normală a lui {}", "Нормальное ускорение {}"),
    "t": ("Tangential acceleration of {}", "Accelerația tangențială a lui {}", "Касательное ускорение {}"),
    "c": ("Coriolis acceleration of {}", "Accelerația Coriolis a lui {}", "Кориолисово ускорение {}"),
    "r": (
        "Acceleration along the guide of {}",
        "Accelerația de-a lungul ghidajului a lui {}",
        "Ускорение вдоль направляющей {}",
    ),
}
RELATIVE = ("{} about {}", "{} față de {}", "{} относительно {}")
RELATIVE_VELOCITY = ("Velocity of {}", "Viteza lui {}", "Скорость {}")


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


# Mechanisms to start from: the library's folder `starts` ------------------------------------------


def folder() -> Path:
    """Where they lie."""
    return library() / "starts"


def starts() -> list[str]:
    """Their names."""
    suffix = SUFFIXES["assignment"]
    return sorted(path.name.removesuffix(suffix) for path in folder().glob(f"*{suffix}"))


def load_start(name: str) -> Assignment:
    """One of them; CallError for an unknown name."""
    if name not in starts():
        raise CallError(
            "unknown_mechanism",
            f"--mechanism {name}: there are {', '.join(starts())}; or --like an assignment",
        )
    return load_assignment(folder() / f"{name}{SUFFIXES['assignment']}")


# A rubric made from the construction: a criterion for everything that is drawn --------------------


def rubric_for(name: str, title: Text, mechanism: Mechanism, *, by_similarity: bool = False) -> RubricFile:
    """A rubric that asks for the scales, the sketch's links, every vector of both plans, and angular ones.

    What students may leave out without harm is optional: declared scales, links, angular quantities, and
    the vectors about both joints of a plate's base, whose third image may come by similarity.
    """
    construction = construction_of(mechanism, plate_by_similarity=by_similarity)
    return RubricFile(
        schema_version=1,
        id=name,
        title=title,
        tolerance=ToleranceTable(
            length_mm=1.0, length_relative=0.02, direction_deg=1.5, across_mm=0.5, least_mm=3.0
        ),
        hand=HandTable(sigmas=4.0, at_most=2.5),
        criterion=list(_criteria(mechanism, construction)),
    )


def _criteria(mechanism: Mechanism, construction: Construction) -> Iterator[CriterionTable]:
    for scale, words in SCALES.items():
        yield CriterionTable(id=scale, scale=scale, points=POINTS_OF_SCALE, optional=True, title=_text(words))  # type: ignore[arg-type]
    for link in construction.links:
        title = _text(tuple(text.format(link) for text in LINK))
        yield CriterionTable(id=link, link=link, points=POINTS_OF_LINK, optional=True, title=title)
    for figure, rate in (("velocity_plan", "omega"), ("acceleration_plan", "epsilon")):
        for vector in construction.vectors_of(figure):
            yield _of_vector(mechanism, vector)
        for name in construction.rates:
            kind, _, link = name.partition("_")
            if kind == rate:
                words = RATES[kind]
                title = Text(en=words[0].format(link), ro=words[1].format(link), ru=words[2].format(link))
                yield CriterionTable(id=name, angular=name, points=POINTS_OF_RATE, optional=True, title=title)


def _of_vector(mechanism: Mechanism, vector: Vector) -> CriterionTable:
    kind, about, *part = vector.name.split("_")
    joint, other = joints_of(about, mechanism.joints)
    plates = {group.node for group in mechanism.groups if isinstance(group, Plate)}
    if joint in plates and other:
        return CriterionTable(
            id=vector.name,
            vector=vector.name,
            points=POINTS_OF_WAY,
            optional=True,
            title=_title(vector, mechanism),
        )
    result = mechanism.groups[-1].node if mechanism.groups else mechanism.joints[-1]
    is_result = not other and not part and joint == result
    points = POINTS_OF_RESULT if is_result else POINTS[part[0] if part else kind]
    return CriterionTable(id=vector.name, vector=vector.name, points=points, title=_title(vector, mechanism))


def joints_of(about: str, joints: tuple[str, ...]) -> tuple[str, str]:
    """The joints in a vector's name: ``BA`` is B about A, ``B3B`` is B3 about B, ``B`` is B alone."""
    for joint in sorted(joints, key=len, reverse=True):
        rest = about.removeprefix(joint)
        if about.startswith(joint) and (not rest or rest in joints):
            return joint, rest
    return about, ""


def _title(vector: Vector, mechanism: Mechanism) -> Text:
    kind, about, *part = vector.name.split("_")
    joint, other = joints_of(about, mechanism.joints)
    words = VECTORS[part[0] if part else kind]
    if not other:
        return Text(en=words[0].format(joint), ro=words[1].format(joint), ru=words[2].format(joint))
    if kind == "v":
        words = RELATIVE_VELOCITY
    whose = [form.format(joint, other) for form in RELATIVE]
    return Text(en=words[0].format(whose[0]), ro=words[1].format(whose[1]), ru=words[2].format(whose[2]))


def _text(words: tuple[str, ...]) -> Text:
    return Text(en=words[0], ro=words[1], ru=words[2])
