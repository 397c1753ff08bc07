"""Authored models as TOML text with a comment for every key.

A key's comment stands at its first place in the file; keys that are not set are shown commented
out, so that all there is can be seen.

`KEYS` has the comment of every key, by table (the name of its model); `example` is shown, commented
out, where the key is not set.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from reference.formula import Formula

WIDTH = 100
NUMBER = re.compile(r"-?\d+(\.\d+)?")
BARE = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True)
class Key:
    """A key's meaning, and what may stand there."""

    text: str
    example: str = ""


VERSION = Key("of this file's form")
FILE_NAME = Key("letters, digits, . _ -; printed on answer sheets")
NODE = Key("the joint that this group adds: a capital, then letters or digits; not O or N")
NEW_LINK = Key("the new link's name")
SAME_LINK = Key("the link that carries the point, and the joints of its base")

TABLES = {
    "Text": "What people read: English is required, ro and ru are optional.",
    "MechanismFile": "A mechanism, without its variants. x right, y up; angles in degrees counter-clockwise"
    " from +x. Wherever a number stands, a formula in quotes may stand, of the values in the assignment"
    " file.",
    "CrankTable": "The driven link.",
    "DrivenSliderTable": "The driven link: a slider on a fixed guide, in place of a crank.",
    "DyadTable": "RRR: two links that meet in a new joint, hinged at two known ones.",
    "SliderTable": "RRP: a slider on a straight guide, with a rod to a known joint.",
    "SlottedLinkTable": "RPR: a link that turns about a pivot; a block hinged at a joint slides along it.",
    "CrossSliderTable": "PRP: a pin with two blocks, each on its guide, one at least on a moving link.",
    "YokeTable": "RPP: a yoke on a fixed guide, driven by a block in its slot.",
    "PlateTable": "plate: a third point of a link, by its distances from two joints of it.",
    "PointOnLineTable": "point_on_line: a point on the line through two joints of a link.",
    "PointTable": "point: a point of a link by coordinates, x from base[0] towards base[1], y to the left.",
    "AssignmentFile": "An assignment: what students are told, what varies, the scales, the sheets.",
    "VariantTable": "What differs between students.",
    "ScalesTable": "The proposed scales: SI units per millimetre on paper, as formulas. They may use the"
    " values above, crank_mm (drawn length of the crank), crank_m (its real length), omega, then kL, then"
    " kv; where a slider drives, speed.",
    "PageTable": "A sheet that students hand in.",
    "GivenTable": "A datum told to the student, as label = value unit.",
    "RubricFile": "A rubric: what is judged, for how many points, and how far off it may be.",
    "ToleranceTable": "How far off full marks may be.",
    "HandTable": "A careful hand's errors, standard deviations of one act: tolerances are widened by what"
    " they add up to.",
    "WeightsTable": "What a section is worth, whatever the points within it add up to.",
    "CriterionTable": "One for each thing judged: exactly one of vector, angular, scale and link.",
}
"""What each table is; said above its first one."""

KEYS: dict[str, dict[str, Key]] = {
    "Text": {"en": Key("English"), "ro": Key("Romanian"), "ru": Key("Russian")},
    "MechanismFile": {
        "schema_version": VERSION,
        "id": Key("the mechanism's name"),
        "title": Key("what people read"),
        "length_unit": Key("m, cm or mm: of every length and coordinate in this file"),
        "ground": Key("Fixed pivots: NAME = [x, y]."),
        "crank": Key("a driven crank"),
        "driven_slider": Key("or a driven slider"),
        "group": Key("One entry for each further joint, in the order of assembly."),
    },
    "CrankTable": {
        "link": Key("its name", '"1"'),
        "pivot": Key("the ground pivot that it turns about"),
        "pin": Key("the joint at its end"),
        "length": Key("from pivot to pin"),
        "angle_deg": Key("where it stands, counter-clockwise from +x"),
        "omega": Key("rad/s, negative for clockwise", '"pi*n1_rpm/30"'),
        "rpm": Key("in place of omega: rev/min, of the motor where there is a gear", '"n1_rpm"'),
        "gear_ratio": Key("the crank turns at rpm / gear_ratio", "23.5"),
        "epsilon": Key("angular acceleration, rad/s^2", "2"),
    },
    "DrivenSliderTable": {
        "link": Key("its name", '"1"'),
        "pin": Key("the joint on the slider"),
        "guide": Key("its fixed guide: a point of it, and its direction"),
        "displacement": Key("from the guide's point, along its direction"),
        "speed": Key("in length_unit per second"),
        "acceleration": Key("in length_unit per second squared", "0"),
    },
    "FixedGuideTable": {"through": Key("a point of the guide"), "angle_deg": Key("its direction")},
    "GuideTable": {
        "through": Key("a point of a fixed guide"),
        "angle_deg": Key("its direction"),
        "joints": Key("or, of a guide on a moving link: two joints of that link"),
        "coincident": Key("and the name of the link's point under the slider, such as D5"),
    },
    "DyadTable": {
        "type": Key("two hinged links"),
        "node": NODE,
        "pins": Key("two joints that are there already"),
        "links": Key("names of the two new links, in the order of the pins"),
        "lengths": Key("of the two links, in the order of the pins"),
        "side": Key("left or right of the directed line from the first pin to the second"),
    },
    "SliderTable": {
        "type": Key("a slider with a rod"),
        "node": NODE,
        "pin": Key("the joint at the rod's other end"),
        "link": Key("the rod's name"),
        "length": Key("of the rod"),
        "guide": Key("a point of the guide and its direction; or joints and coincident, on a moving link"),
        "side": Key("ahead or behind: where the slider is, seen from the pin along the guide's direction"),
    },
    "SlottedLinkTable": {
        "type": Key("a turning guide"),
        "node": Key("the link's point under the block's pin, such as B3 under B"),
        "pin": Key("the joint that carries the block"),
        "pivot": Key("the joint about which the link turns"),
        "link": NEW_LINK,
        "offset": Key("how far the pin is to the left of the parallel to the guide through the pivot", "0"),
        "foot": Key("with an offset: the name of the guide's nearest point to the pivot", '"E"'),
        "side": Key("ahead or behind: where the pin is, seen from the pivot along the guide", '"ahead"'),
    },
    "CrossSliderTable": {
        "type": Key("two guides that cross"),
        "node": NODE,
        "guides": Key("the two guides, each fixed (through, angle_deg) or moving (joints, coincident)"),
    },
    "YokeTable": {
        "type": Key("a slot on a slider"),
        "node": Key("the yoke's point where slot and guide cross"),
        "pin": Key("the joint that carries the block"),
        "slot_deg": Key("direction of the slot"),
        "guide": Key("the yoke's fixed guide: a point of it, and its direction"),
    },
    "PlateTable": {
        "type": Key("a third point of a link"),
        "node": NODE,
        "base": Key("two joints of the link"),
        "link": SAME_LINK,
        "lengths": Key("distances from the two; in line with them, its image comes by similarity"),
        "side": Key("left or right of the directed base; needed unless in line with it", '"left"'),
    },
    "PointOnLineTable": {
        "type": Key("a point in line with a link"),
        "node": NODE,
        "base": Key("two joints of the link"),
        "link": SAME_LINK,
        "ratio": Key("0 at the first, 1 at the second, 0.5 in the middle, 2 as far again"),
    },
    "PointTable": {
        "type": Key("a point by coordinates"),
        "node": NODE,
        "base": Key("origin, and the joint on the x axis; of a slotted link its pivot and its node"),
        "link": SAME_LINK,
        "at": Key("x along the base, y to its left"),
    },
    "AssignmentFile": {
        "schema_version": VERSION,
        "id": FILE_NAME,
        "title": Key("Title, as students read it."),
        "task": Key("The task, as students read it."),
        "mechanism": Key("NAME.mechanism.toml beside this file, or a built-in one"),
        "rubric": Key("NAME.rubric.toml beside this file, or a built-in one"),
        "variant": Key("what differs between students"),
        "scales": Key("the proposed scales"),
        "plate_images": Key(
            "or similarity: how a plate's third point is drawn in the plans", '"perpendiculars"'
        ),
        "page": Key("the sheets"),
        "given": Key("the data told"),
        "tradition": Key("o: poles o and o', scales kL, kv, ka; p: poles p and π, scales μl, μv, μa", '"o"'),
        "names": Key("What students see instead of a name.", '{ "o" = "p", "kv" = "μv" }'),
        "assumptions": Key(
            "what the source leaves open and this file settles", '["B to the right of A -> O2"]'
        ),
    },
    "VariantTable": {
        "n": Key("the student's number"),
        "position": Key("positions, where each student draws several", "{ from = 0, to = 7 }"),
        "values": Key(
            "Data that follow from them; each may use those above it. Functions: sqrt sin cos tan abs floor"
            " ceil radians degrees (of radians, but for radians); pi; + - * / % **."
        ),
    },
    "Range": {"first": Key("the first number"), "last": Key("the last number")},
    "ScalesTable": {
        "crank_mm": Key("how long the crank is drawn", "50"),
        "kL": Key("m/mm"),
        "kv": Key("(m/s)/mm"),
        "ka": Key("(m/s^2)/mm; with kL ka = kv^2 normal components can be built by the right triangle"),
        "bare_units": Key("the unit of a scale that students write as a bare number", '{ kv = "(m/s)/mm" }'),
    },
    "PageTable": {
        "kind": Key("all, velocity or acceleration"),
        "figures": Key("what is drawn on it: mechanism, velocity_plan, acceleration_plan"),
    },
    "GivenTable": {
        "label": Key("as the student reads it"),
        "value": Key("a number or a formula"),
        "unit": Key("as the student reads it", '"cm"'),
    },
    "RubricFile": {
        "schema_version": VERSION,
        "id": Key("the rubric's name"),
        "title": Key("what people read"),
        "tolerance": Key("limits"),
        "hand": Key("the hand that they are widened for"),
        "weights": Key("what sections are worth", "{ mechanism = 5, scales = 5, angular = 10 }"),
        "missing": Key("the verdict on what was not handed in: review, none or not_judged", '"review"'),
        "least_confidence": Key("a reading less certain than this goes to a person", "0.9"),
        "follow_through": Key("full marks for what follows rightly from an earlier mistake", "true"),
        "least_followed_share": Key("no credit for what follows and is shorter than this share", "0.2"),
        "criterion": Key("what is judged"),
    },
    "ToleranceTable": {
        "length_mm": Key("a length may be off by so many millimetres,", "1.0"),
        "length_relative": Key("or by this share of it, whichever is larger", "0.02"),
        "direction_deg": Key("a direction by so many degrees,", "1.5"),
        "across_mm": Key("or by so much across the vector's end, whichever is larger", "0.5"),
        "least_mm": Key("vectors shorter than this are not judged on their direction", "3.0"),
        "scale_relative": Key("for declared scales and angular quantities", "0.02"),
        "certain_errors": Key("standard errors of a scan's reading within which a person decides", "1.645"),
        "partial_factor": Key("up to so many times the limits", "2.0"),
        "partial_share": Key("there are so many of the points", "0.5"),
        "bands": Key("in place of both, several steps", "[{ factor = 1.5, share = 0.75 }]"),
    },
    "Band": {
        "factor": Key("up to so many times the limits"),
        "share": Key("there is this share of the points"),
    },
    "HandTable": {
        "angle_deg": Key("a line set along or across another", "0.3"),
        "place_mm": Key("a length transferred, an arc opened", "0.25"),
        "mark_mm": Key("a point marked", "0.1"),
        "ruler_mm": Key("a length measured and entered", "0.2"),
        "protractor_deg": Key("a direction measured and entered", "0.4"),
        "sigmas": Key("so many standard deviations are allowed; 0: limits stay as they are", "4.0"),
        "at_most": Key("no limit grows to more than so many times itself", "2.5"),
    },
    "WeightsTable": {
        "mechanism": Key("links of the sketch", "5"),
        "scales": Key("declared scales", "5"),
        "velocity_plan": Key("vectors of the velocity plan", "40"),
        "acceleration_plan": Key("vectors of the acceleration plan", "40"),
        "angular": Key("angular velocities and accelerations", "10"),
    },
    "CriterionTable": {
        "id": Key("its name in the report"),
        "title": Key("what the student reads"),
        "points": Key("for full marks"),
        "vector": Key("a vector, such as v_B, v_BA, a_BA_n", '"v_B"'),
        "angular": Key("or an angular quantity, such as omega_3", '"omega_3"'),
        "scale": Key("or a scale: kL, kv, ka", '"kL"'),
        "link": Key("or a link of the sketch, such as AB", '"AB"'),
        "optional": Key("true: not judged where it was not handed in", "true"),
        "direction": Key("false: only the length counts", "true"),
        "follow_through": Key("the rubric's, for this criterion alone", "true"),
        "tolerance": Key("limits for this criterion alone", "{ length_mm = 2.0 }"),
    },
}


# Writing ------------------------------------------------------------------------------------------


def commented(model: BaseModel, head: str) -> str:
    """The text of a file: its head, then every table and key with what it means."""
    lines = [*_remark(head), *_Writer().table(model, "")]
    return "\n".join(lines).rstrip() + "\n"


def _remark(text: str) -> Iterator[str]:
    """A comment, wrapped; a line of its own where the text has one."""
    for paragraph in text.splitlines():
        line = "#"
        for word in paragraph.split(" "):
            if len(line) + 1 + len(word) > WIDTH:
                yield line
                line = "#"
            line += f" {word}"
        yield line.rstrip()


class _Writer:
    """Writes tables, and remembers what it has explained."""

    def __init__(self) -> None:
        self.said: set[tuple[str, str]] = set()

    def table(self, model: BaseModel, path: str, *, flat: bool = False) -> Iterator[str]:
        """The keys of a table, then the tables within it (`flat`: on the keys' lines)."""
        kind = type(model).__name__
        tables: list[tuple[str, object]] = []
        for field, info in type(model).model_fields.items():
            value, name = getattr(model, field), info.alias or field
            is_set = value is not None and (field in model.model_fields_set or info.is_required())
            if is_set and _is_table(value) and not flat:
                tables.append((name, value))
            elif is_set and value not in ([], {}):
                yield from self._line(kind, field, f"{_bare(name)} = {_spread(value)}")
            else:
                yield from self._offer(kind, field, name)
        for name, value in tables:
            yield from self._within(kind, name, value, f"{path}.{_bare(name)}" if path else _bare(name))

    def _within(self, kind: str, name: str, value: object, path: str) -> Iterator[str]:
        """A table, a dictionary or a list of tables under its heading."""
        if isinstance(value, list):
            for model in value:
                yield ""
                yield from self._heading(type(model).__name__)
                yield f"[[{path}]]"
                yield from self.table(model, path, flat=True)
        elif isinstance(value, BaseModel):
            yield ""
            yield from self._heading(type(value).__name__, KEYS.get(kind, {}).get(name))
            if not _is_empty(value):
                yield f"[{path}]"
            yield from self.table(value, path)
        elif isinstance(value, Mapping):
            yield ""
            key = KEYS.get(kind, {}).get(name)
            yield from _remark(key.text) if key else ()
            yield f"[{path}]"
            yield from (f"{_bare(one)} = {inline(held)}" for one, held in value.items())

    def _heading(self, kind: str, key: Key | None = None) -> Iterator[str]:
        if kind == "Text":
            yield from _remark(key.text) if key else ()
        elif (kind, "") not in self.said:
            self.said.add((kind, ""))
            yield from _remark(TABLES.get(kind, ""))

    def _line(self, kind: str, field: str, line: str) -> Iterator[str]:
        """A key with its comment, behind it where there is room."""
        key = KEYS.get(kind, {}).get(field)
        if key is None or kind == "Text" or (kind, field) in self.said:
            yield line
            return
        self.said.add((kind, field))
        if len(line) + 4 + len(key.text) <= WIDTH:
            yield f"{line}  # {key.text}"
        else:
            yield from _remark(key.text)
            yield line

    def _offer(self, kind: str, field: str, name: str) -> Iterator[str]:
        """A key that is not set, commented out, once."""
        key = KEYS.get(kind, {}).get(field)
        if key is not None and key.example and (kind, field) not in self.said:
            self.said.add((kind, field))
            yield f"# {name} = {key.example}  # {key.text}"


def _is_empty(model: BaseModel) -> bool:
    """Whether a table has only tables within it."""
    return all(_is_table(getattr(model, field)) for field in model.model_fields_set)


def _is_table(value: object) -> bool:
    """What stands under a heading of its own: larger tables, and lists of tables."""
    if isinstance(value, list):
        return bool(value) and isinstance(value[0], BaseModel) and type(value[0]).__name__ in TABLES
    if isinstance(value, Mapping):
        return bool(value)
    return isinstance(value, BaseModel) and type(value).__name__ in TABLES


def inline(value: Any) -> str:  # noqa: ANN401 - whatever stands in an authored file
    """A value on one line."""
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case str():
            return quoted(value)
        case Formula(text=text):
            return text if NUMBER.fullmatch(text) else quoted(text)
        case list() | tuple():
            return f"[{', '.join(inline(one) for one in value)}]"
        case BaseModel():
            fields = type(value).model_fields
            told = {
                info.alias or field: getattr(value, field)
                for field, info in fields.items()
                if getattr(value, field) is not None
                and (field in value.model_fields_set or info.is_required())
            }
            return inline(told)
        case Mapping():
            return f"{{ {', '.join(f'{_bare(name)} = {inline(one)}' for name, one in value.items())} }}"
    raise ValueError(f"expected what an authored file may hold, got {type(value).__name__}")


def _spread(value: object) -> str:
    """A value; a long list with a line for each of its members."""
    text = inline(value)
    if not isinstance(value, list) or len(text) <= WIDTH:
        return text
    return "\n".join(["[", *(f"  {inline(one)}," for one in value), "]"])


def quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    escaped = "".join(
        letter if letter >= " " and letter != "\x7f" else f"\\u{ord(letter):04x}" for letter in escaped
    )
    return f'"{escaped}"'


def _bare(name: str) -> str:
    return name if BARE.fullmatch(name) else quoted(name)
