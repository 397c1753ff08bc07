"""Make the assignment and the rubric for an author's mechanism, from its file and its construction.

They are the four-bar's commented files with other titles, data, scales and criteria.
"""

import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import compress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from grader.authoring.lint import lint, names_in
from grader.authoring.round_scales import asked_vectors
from grader.language import LANGUAGES, N_, tongue
from grader.rubric import RubricFile, load_rubric
from grader.texts.spoken import failure, lines_of
from reference.authored.assignment import SUFFIXES, USUAL_SCALES, Assignment, load_assignment
from reference.authored.formula import Formula
from reference.authored.mechanism import (
    CrankTable,
    CylinderTable,
    DrivingSliderTable,
    DyadTable,
    MechanismFile,
    PlateTable,
    SliderTable,
    SlottedLinkTable,
    TriadTable,
)
from reference.authored.toml_file import SideText, Text, load, text_of
from reference.authored.variant_table import KEYS, MEASURES
from reference.construction.graph import Construction
from reference.errors import AuthoredFileError, CallError
from reference.plan import construction_for

Texts = Mapping[str, str]
"""Texts of the assignment and of the rubric, by their kind."""
RANGES = {"n": "{ from = 1, to = 30 }", "position": "{ from = 0, to = 7 }"}
"""Ranges of students and positions for a mechanism whose formulas use their numbers."""
_UNITS = {
    "length": "{length}", "angle": "°", "rpm": "rev/min", "omega": "rad/s", "epsilon": "rad/s²",
    "speed": "{length}/s", "acceleration": "{length}/s²", "mass": "kg", "inertia": "kg m²", "force": "N",
    "couple": "N m",
}  # fmt: skip
"""Units of the keys of a mechanism, by the kind of quantity."""

TITLE = N_("%(mechanism)s: velocities and accelerations")
TASK = N_(
    "Draw the mechanism, the velocity plan and the acceleration plan of your variant. Declare kL, kv and ka."
)
SCALES = {
    "kL": N_("Scale of lengths"), "kv": N_("Scale of velocities"), "ka": N_("Scale of accelerations"),
    "kF": N_("Scale of forces"),
}  # fmt: skip
LINK = N_("Link %(name)s on the sketch")
RATES = {
    "omega": N_("Angular velocity of link %(name)s"),
    "epsilon": N_("Angular acceleration of link %(name)s"),
}
ABSOLUTE = {
    "v": N_("Velocity of %(point)s"), "a": N_("Acceleration of %(point)s"),
    "a_n": N_("Normal acceleration of %(point)s"), "a_t": N_("Tangential acceleration of %(point)s"),
    "a_c": N_("Coriolis acceleration of %(point)s"), "a_r": N_("Acceleration of %(point)s along the guide"),
}  # fmt: skip
RELATIVE = {
    "v": N_("Velocity of %(point)s relative to %(other)s"),
    "a": N_("Acceleration of %(point)s relative to %(other)s"),
    "a_n": N_("Normal acceleration of %(point)s relative to %(other)s"),
    "a_t": N_("Tangential acceleration of %(point)s relative to %(other)s"),
    "a_c": N_("Coriolis acceleration of %(point)s relative to %(other)s"),
    "a_r": N_("Acceleration of %(point)s relative to %(other)s along the guide"),
}
"""Titles of vectors, by their letter and part."""
FORCES = {
    "F_i": N_("Inertia force of link %(name)s"), "G_": N_("Weight of link %(name)s"),
    "F_": N_("Load %(name)s"), "R_": N_("Reaction of link %(other)s on link %(name)s"),
    "R_0": N_("Reaction of the frame on link %(name)s"),
    "R_0t": N_("Part, across the link, of the reaction of the frame on link %(name)s"),
    "R_t": N_("Part, across the link, of the reaction of link %(other)s on link %(name)s"),
    "M_": N_("Balancing moment"),
}  # fmt: skip
"""Titles of forces, by the start of their names, and the part of a reaction; the frame is 0."""
_POINTS = {"scale": 1.0, "link": 0.5, "vector": 2.0, "angular": 0.5, "moment": 3.0}
_OPTIONAL = {"scale", "link", "angular", "moment"}
"""Items that a student may leave out without losing points."""
KEYS_OF_A_CRITERION = """\
# One for each thing judged: exactly one of vector, value, angular, moment, sense, scale, link and point. Of
# its other keys: points for full marks; optional = true: not judged where it was not handed in; direction =
# false: only the length counts."""
"""Replaces the start's comments, which stand at keys that not every criterion has."""
_PLANS_MM = 60.0
"""Length of a plan's first vector at the trial scales from which round ones are derived."""


def texts_for(mechanism: Path, name: str, start: Texts, table: Path | None) -> dict[str, str]:
    """Return the assignment and rubric for a mechanism's file, at round scales that fit the answer sheets.

    Arguments
    ---------
    mechanism : the file, NAME.mechanism.toml
    name : of the new assignment
    start : commented files of which all but titles, data, scales and criteria is kept
    table : the variants' data, if the mechanism has formulas of other names than `n` and `position`

    Raises AuthoredFileError with the faults of the mechanism or of the table, CallError if the mechanism
    needs a table and none is given, or no variant of it assembles.
    """
    file = load(MechanismFile, mechanism)
    needed = names_in(file) - {*KEYS}
    if needed and table is None:
        raise failure(CallError, "table_needed", file=mechanism, names=tuple(sorted(needed)))
    first: dict[str, float | str] = {
        "kL": 0.001,
        "kv": f"{'speed' if file.driving_slider else 'omega * crank_m'} / {_PLANS_MM:g}",
        "ka": "kv**2 / kL",
    }
    with TemporaryDirectory() as folder:
        beside = Path(folder)
        paths = {kind: beside / f"{name}{SUFFIXES[kind]}" for kind in SUFFIXES}
        paths["mechanism"].write_bytes(mechanism.read_bytes())
        if table is not None:
            (beside / table.name).write_text(text_of(table), encoding="utf-8")
        assignment = _assignment(file, name, start["assignment"], first, table)
        paths["assignment"].write_text(assignment, encoding="utf-8")
        try:
            loaded = load_assignment(paths["assignment"])
        except AuthoredFileError as error:
            # The copies are gone when the message is read.
            of_table = table is not None and Path(error.file).name == table.name
            raise AuthoredFileError(str(table if of_table else mechanism), error.findings) from error
        rubric = _rubric(file, name, start["rubric"], loaded)
        paths["rubric"].write_text(rubric, encoding="utf-8")
        found = lint(loaded, load_rubric(paths["rubric"]))
        if not found.scales:
            faults = lines_of([one.told() for one in found.findings if one.severity == "fault"])
            raise failure(CallError, "no_variant", file=mechanism, findings=faults)
        scales = {
            scale: float(f"{np.max(getattr(found.scales[1].scales, scale)):.6g}") for scale in USUAL_SCALES
        }
        paths["assignment"].write_text(
            _assignment(file, name, start["assignment"], scales, table), encoding="utf-8"
        )
        fitting = load_assignment(paths["assignment"])
        rubric = _rubric(
            file, name, start["rubric"], fitting, _too_short(fitting, load_rubric(paths["rubric"]))
        )
        return {"assignment": paths["assignment"].read_text(encoding="utf-8"), "rubric": rubric}


def _too_short(assignment: Assignment, rubric: RubricFile) -> set[str]:
    """Return the vectors that in most variants are zero or too short to judge their direction."""
    plan = lint(assignment, rubric).plan
    asked = plan and asked_vectors(rubric, plan)
    return {*compress(asked.names, asked.mostly_short)} if asked else set()


# The assignment -----------------------------------------------------------------------------------


def _assignment(
    file: MechanismFile, name: str, start: str, scales: Mapping[str, float | str], table: Path | None
) -> str:
    """Return the start's text with other keys in its tables."""
    used = names_in(file)
    variant = [f"{key} = {RANGES[key]}" for key in KEYS if key in used and not (key == "n" and table)]
    variant += [f"table = {_text(table.name)}"] if table else []
    given = [
        [f"label = {_text(label)}", f"value = {_value(value)}", *([f"unit = {_text(unit)}"] if unit else [])]
        for label, value, unit in _given(file)
    ]
    blocks = {_heading(block): block for block in reversed(start.split("\n\n"))}
    head = blocks[""]
    for key in ("id", "mechanism", "rubric"):
        head = re.sub(rf'(?m)^{key} = "[^"]*"', f"{key} = {_text(name)}", head)
    pages = [block for block in start.split("\n\n") if _heading(block) == "page"]
    body = [
        head,
        _with(blocks["title"], _titles(file.title, TITLE)),
        _with(blocks["task"], _titles(Text(en="", ro="", ru=""), TASK)),
        _with(blocks["variant"], variant),
        _with(blocks["scales"], [f"{scale} = {json.dumps(value)}" for scale, value in scales.items()]),
        *pages,
        *("\n".join(["[[given]]", *lines]) for lines in given),
    ]
    return "\n\n".join(body).rstrip("\n") + "\n"


def _heading(block: str) -> str:
    """Return the name of the table that a block of lines is."""
    found = re.search(r"(?m)^\[+([a-z.]+)\]", block)
    return found[1] if found else ""


def _with(block: str, keys: Iterable[str]) -> str:
    """Return a table's comments and heading, with other keys."""
    lines = block.split("\n")
    at = next(place for place, line in enumerate(lines) if line.startswith("[")) + 1
    return "\n".join([*lines[:at], *keys, *(line for line in lines[at:] if line.startswith("#"))])


def _value(formula: str) -> str:
    """Write a number as it is, any other formula as text."""
    try:
        return f"{float(formula):.15g}"
    except ValueError:
        return _text(formula)


def _text(value: object) -> str:
    """Return a TOML string, which for these texts is JSON's."""
    return json.dumps(value, ensure_ascii=False)


def _titles(title: Text, phrase: str) -> list[str]:
    """Return a phrase in the languages of the mechanism's title."""
    known = {lang: getattr(title, lang) for lang in LANGUAGES}
    return [
        f"{lang} = {_text(tongue(lang).gettext(phrase) % {'mechanism': text})}"
        for lang, text in known.items()
        if text is not None
    ]


def _given(file: MechanismFile) -> Iterator[tuple[str, str, str]]:
    """Yield label, value and unit of the data that the student needs to draw the mechanism."""
    tables: list[Any] = [file.driver, *filter(None, [file.crank and file.crank.cylinder]), *file.group]
    for joint, at in file.ground.items():
        yield from _point(joint, at, file.length_unit)
    for table in tables:
        labels = _labels(table)
        for key, value in table:
            if isinstance(value, SideText) and isinstance(value.side, Formula):
                yield (
                    labels.get(key, f"{table.node}, {key}"),
                    value.side.text,
                    "",
                )
        for key, measure in MEASURES.items():
            values = getattr(table, key, None)
            if key in ("through", "at") or values is None:
                continue
            unit = _UNITS[measure].format(length=file.length_unit)
            for index, one in enumerate(values if isinstance(values, list) else [values]):
                yield labels.get((key, index), labels.get(key, key)), one.text, unit
        guides = getattr(table, "guides", None) or [getattr(table, "guide", None)]
        node = str(getattr(table, "node", None) or getattr(table, "pin", ""))
        for guide in guides:
            if guide is not None and guide.angle_deg is not None:
                yield from _point(f"guide {node}", guide.through, file.length_unit)
                yield f"φ(guide {node})", guide.angle_deg.text, "°"
        if getattr(table, "at", None) is not None:
            yield from _point(f"{node}, {table.base[0]}→{table.base[1]}", table.at, file.length_unit)
        if getattr(table, "ratio", None) is not None:
            yield f"{table.base[0]}{node} : {table.base[0]}{table.base[1]}", table.ratio.text, ""
        if getattr(table, "gear_ratio", None) is not None:
            yield "i", table.gear_ratio.text, ""


def _point(name: str, at: Any, unit: str) -> Iterator[tuple[str, str, str]]:  # noqa: ANN401 - two formulas
    for axis, value in zip("xy", at, strict=True):
        if value.text not in ("0", "0.0"):
            yield f"{axis}({name})", value.text, unit


def _labels(table: object) -> dict[Any, str]:
    """Return labels of a table's data, by key, or by key and index in a list."""
    match table:
        case CrankTable():
            link = table.link
            return {
                "length": table.pivot + table.pin, "angle_deg": f"φ{link}", "omega": f"ω{link}", "rpm": "n",
                "epsilon": f"ε{link}",
            }  # fmt: skip
        case CylinderTable(pivot=pivot):
            letters = {"length": "s", "speed": "v", "acceleration": "a", "side": "s"}
            return {key: f"{letter}({pivot})" for key, letter in letters.items()}
        case DrivingSliderTable():
            return {"displacement": "s", "speed": "v", "acceleration": "a"}
        case DyadTable(node=node, pins=base) | PlateTable(node=node, base=base):
            lengths = {("lengths", index): pin + node for index, pin in enumerate(base)}
            return {**lengths, "side": f"{node}, {base[0]}→{base[1]}"}
        case SliderTable():
            return {"length": table.pin + table.node, "side": f"{table.node}, {table.pin}"}
        case TriadTable(nodes=(d, e, f), pins=(a, b, c)):
            ends = (a + d, b + e, c + f, d + e, e + f, f + d)
            return {("lengths", index): name for index, name in enumerate(ends)} | {
                ("angle_deg", 0): f"φ({d}{e}) ± 20°", "side": f"{f}, {d}→{e}",
            }  # fmt: skip
        case SlottedLinkTable():
            return {"offset": f"{table.pivot}{table.foot}"}
    return {}


# The rubric ---------------------------------------------------------------------------------------


def _rubric(
    file: MechanismFile, name: str, start: str, assignment: Assignment, unasked: Collection[str] = ()
) -> str:
    """Return the start's rubric with a criterion for each scale, link, vector and angular quantity."""
    blocks = [block for block in start.split("\n\n") if "[[criterion]]" not in block]
    titles = _titles(file.title, TITLE)
    blocks = [_with(block, titles) if _heading(block) == "title" else block.rstrip("\n") for block in blocks]
    blocks[0] = re.sub(r'(?m)^id = "[^"]*"', f"id = {_text(name)}", blocks[0])
    criteria = [*_criteria(assignment)]
    asked = [KEYS_OF_A_CRITERION, *(_criterion(*one) for one in criteria if one[1] not in unasked)]
    left_out = [_criterion(*one) for one in criteria if one[1] in unasked]
    if left_out:
        asked.append(
            "# Not asked for: too short in most variants to be judged on their direction. Without the # they"
            "\n# are judged there on their length alone, and lint names the variants."
        )
        asked += [re.sub("(?m)^", "# ", one) for one in left_out]
    return "\n\n".join([*blocks, *asked]) + "\n"


def with_forces(rubric: str, assignment: Assignment) -> str:
    """Return a rubric's text with criteria for all that an assignment's pages show, in place of its own."""
    kept = [block.partition("[[criterion]]") for block in rubric.split("\n\n")]
    # Of a block with a criterion, the keys before it; remarks alone are about criteria.
    blocks = [head.rstrip("\n") for head, cut, _ in kept if not cut or re.search("(?m)^[^#\n]", head)]
    asked = [KEYS_OF_A_CRITERION, *(_criterion(*one) for one in _criteria(assignment))]
    return "\n\n".join([*blocks, *asked]) + "\n"


def _criteria(assignment: Assignment) -> Iterator[tuple[str, str, str, Mapping[str, str]]]:
    """Yield kind, name, phrase and its names of a criterion for each item on the pages that can be asked for.

    Of forces the given ones, whole reactions and parts that are computed.
    """
    construction, shown = construction_for(assignment), assignment.figures
    crank = assignment.mechanism_file.crank
    computed = {"omega"} if crank and crank.rpm is not None else set()  # of the driving link
    yield from (("scale", name, SCALES[name], {}) for name in assignment.scale_names)
    links = [name for name, pair in construction.links.items() if construction.dots.isdisjoint(pair)]
    yield from (("link", name, LINK, {"name": name}) for name in links)
    drawn = {name for name, one in construction.vectors.items() if construction.figure_of(one.head) in shown}
    for name, vector in construction.vectors.items():
        of_forces = vector.scale == "kF"
        if name in drawn and (vector.part != "n" if of_forces else not vector.is_sum):
            yield "vector", name, *(_force_titled(name) if of_forces else titled(name, construction))
    for name, rate in construction.rates.items():
        kind, _, link = name.partition("_")
        if rate.vector in drawn and (not rate.drives or kind in computed):
            yield "angular", name, RATES[kind], {"name": link}
    for name in construction.moments:
        yield "moment", name, FORCES["M_"], {}


def _force_titled(name: str) -> tuple[str, dict[str, str]]:
    """Return the phrase for a force, and the links that it names: ``R_13`` is of 1 on 3, ``R_2a-3`` of 2a."""
    letter, body, *part = name.split("_")
    by, on = body.split("-") if "-" in body else (body[:1], body[1:])
    of_frame = "0" if letter == "R" and by == "0" else ""
    kind = "F_i" if name.startswith("F_i") else f"{letter}_{of_frame}{''.join(part)}"
    return FORCES[kind], {"name": on if letter == "R" else body.removeprefix("i"), "other": by}


def _criterion(kind: str, name: str, phrase: str, known: Mapping[str, str]) -> str:
    title = ", ".join(f"{lang} = {_text(tongue(lang).gettext(phrase) % known)}" for lang in LANGUAGES)
    lines = ["[[criterion]]", f"id = {_text(name)}", f"title = {{ {title} }}", f"points = {_POINTS[kind]}"]
    lines += [f"{kind} = {_text(name)}", *(["optional = true"] if kind in _OPTIONAL else [])]
    return "\n".join(lines)


def titled(name: str, construction: Construction) -> tuple[str, dict[str, str]]:
    """Return the phrase for a vector, and the points that it names: ``a_BA_n`` is of B relative to A."""
    letter, body, *part = name.split("_")
    joints = {joint for vector in construction.vectors.values() for joint in vector.link or ()}
    joints |= {joint for link in construction.links.values() for joint in link}
    kind = "_".join([letter, *part])
    pairs = [(body[:at], body[at:]) for at in range(1, len(body)) if {body[:at], body[at:]} <= joints]
    if body not in joints and pairs:
        point, other = pairs[0]
        return RELATIVE[kind], {"point": point, "other": other}
    return ABSOLUTE[kind], {"point": body}
