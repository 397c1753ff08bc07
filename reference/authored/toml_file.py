"""Authored files: mechanisms and assignments in TOML, validated, with all faults of a file at once."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    WithJsonSchema,
)

from reference.authored import formula
from reference.authored.chain import ONE_DRIVING_LINK
from reference.authored.formula import Formula
from reference.errors import MOST_FINDINGS, AuthoredFileError, Finding, counted, look_alikes, near_names

LENGTH_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
MAX_BYTES = 200_000
"""Twenty times the largest file that comes with the program."""
MAX_DEPTH = 12
"""Three times as deep as the tables of the formats go."""
NOT_TOML = "not_toml"
"""The code of a file whose syntax is wrong."""
MAX_NAME = 64
_ENDLESS_KEY = re.compile(rb"(?:\.[ \t]*[\w\"'-]+[ \t]*){100}")
"""The parser's time grows with the square of a dotted key's parts: 20,000 of them take 20 s."""
LARGEST_NUMBER = 1e300
"""Its neighbours overflow in the first product."""


Model = TypeVar("Model", bound=BaseModel)


class Authored(BaseModel):
    """A table of an authored file: frozen, nothing unknown, nothing coerced."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, arbitrary_types_allowed=True, defer_build=True
    )


def _read_formula(value: object) -> Formula:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError('a number or a formula in quotes, such as "2*(30+n)", is expected')  # noqa: TRY004
    return formula.parse(value)


def _check_joint(name: str) -> str:
    if not (name.isalnum() and name.isascii()) or not name[0].isupper() or name.lower() in {"o", "n"}:
        # A joint's image in the plans is its name in lower case: the two must differ.
        raise ValueError(
            f"'{name}' is no joint's name: a capital, then letters or digits (not O or N){look_alikes(name)}"
        )
    return name


FormulaText = Annotated[
    Formula,
    BeforeValidator(_read_formula),
    PlainSerializer(lambda f: f.text),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string"}]}),
]
LEFT_RIGHT, AHEAD_BEHIND = ("left", "right"), ("ahead", "behind")
SIDES = {word: sign for pair in (LEFT_RIGHT, AHEAD_BEHIND) for word, sign in zip(pair, (1, -1), strict=True)}
"""Words for a group's side."""

NO_SIDES = {"above", "below", "up", "down", "over", "under", "front", "back", "open", "crossed"}
"""Words that people write for a side but that name neither side of a line: never names of data."""


@dataclass(frozen=True, slots=True)
class SideText:
    """A group's side: a word, or a formula of the variant's data (above zero: the first of the two words)."""

    words: tuple[str, str]
    side: int | Formula


def _side_of(words: tuple[str, str]) -> BeforeValidator:
    def read(value: object) -> SideText:
        if value in words:
            return SideText(words, SIDES[str(value)])
        if str(value).lower() in NO_SIDES or (
            isinstance(value, str) and near_names(value, SIDES, cutoff=0.75)
        ):
            raise ValueError(f"'{value}' is no side of this group: it must be '{words[0]}' or '{words[1]}'")
        try:
            return SideText(words, _read_formula(value))
        except ValueError as error:
            raise ValueError(f"must be {words[0]} or {words[1]}, or a formula: {error}") from error

    return BeforeValidator(read)


def _written_side(side: SideText) -> str:
    return side.side.text if isinstance(side.side, Formula) else side.words[side.side < 0]


def _schema_of(words: tuple[str, str]) -> WithJsonSchema:
    return WithJsonSchema({"anyOf": [{"enum": list(words)}, {"type": "string"}, {"type": "number"}]})


LeftRight = Annotated[SideText, _side_of(LEFT_RIGHT), PlainSerializer(_written_side), _schema_of(LEFT_RIGHT)]
AheadBehind = Annotated[
    SideText, _side_of(AHEAD_BEHIND), PlainSerializer(_written_side), _schema_of(AHEAD_BEHIND)
]
Joint = Annotated[str, Field(min_length=1, max_length=4), AfterValidator(_check_joint)]
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")]
LinkName = Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,4}$")]
TwoJoints = Annotated[list[Joint], Field(min_length=2, max_length=2)]
TwoFormulas = Annotated[list[FormulaText], Field(min_length=2, max_length=2)]
Point = TwoFormulas


class Text(Authored):
    """A text in the languages of feedback; English is required."""

    en: str
    ro: str | None = None
    ru: str | None = None

    def in_language(self, language: str) -> str:
        """Return the text in a language, or in English if it is not given."""
        return getattr(self, language, None) or self.en


def load(model: type[Model], path: Path) -> Model:
    """Read and validate one authored file.

    Raises AuthoredFileError with every fault found, each with its path in the file.
    """
    text = text_of(path)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # Besides TOMLDecodeError: numbers of thousands of digits, tables nested a thousand deep.
        raise AuthoredFileError(str(path), (_no_toml(error, text),)) from error
    faults = tuple(_check_tree(data))
    if faults:
        raise AuthoredFileError(str(path), faults)
    return validate(model, data, str(path))


def _no_toml(error: Exception, text: str) -> Finding:
    """Report invalid TOML with the faulty line and the most likely remedy."""
    found = re.search(r" \(at line (\d+), column \d+\)", str(error))
    if found is None:
        return Finding("$", f"is not TOML: {error}", NOT_TOML)
    line = text.split("\n")[int(found[1]) - 1].strip()
    advice = ""
    if re.search(r"=.*\d,\d", line):
        advice = "; a number has a decimal point"
    elif re.search(r"=\s*[\d.+-]+\s*[^\d\s#]", line):
        advice = "; a number stands alone, without its unit, and a formula in quotes"
    elif line.count('"') % 2:
        advice = "; a quote is opened and never closed"
    elif line.startswith("[") and re.search("twice|overwrite", str(error)):
        advice = f"; a table that stands more than once has two brackets: [[{line.strip('[] ')}]]"
    what = str(error).replace(found[0], "")
    return Finding(f"line {found[1]}", f"is not TOML: {line[:MAX_NAME]} ({what}{advice})", NOT_TOML)


def text_of(path: Path) -> str:
    """Return the text of an authored file or of a table beside it; raises AuthoredFileError without one."""
    try:
        return _content_of(path).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise AuthoredFileError(str(path), (Finding("$", "there is no such file"),)) from error
    except OSError as error:
        raise AuthoredFileError(str(path), (Finding("$", f"cannot be read: {error.strerror}"),)) from error
    except UnicodeDecodeError as error:
        raise AuthoredFileError(str(path), (Finding("$", "is not UTF-8 text; save it as UTF-8"),)) from error


def _content_of(path: Path) -> bytes:
    """Return a file's bytes, up to the largest authored size; raises OSError or AuthoredFileError."""
    if path.exists() and not path.is_file():
        why = "cannot be read: it is a folder or a device, not a file"
    else:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            why = f"is larger than {MAX_BYTES // 1000} kB: nothing that is written by hand is"
        elif _ENDLESS_KEY.search(content):
            why = f"has a key of more than {MAX_DEPTH} parts: nothing that is authored nests so"
        else:
            return content
    raise AuthoredFileError(str(path), (Finding("$", why),))


def is_file(path: Path) -> bool:
    """Return whether a file exists; False for a name that the system refuses."""
    try:
        return path.is_file()
    except OSError:
        return False


def _check_tree(data: dict[str, Any]) -> Iterator[Finding]:
    """Report numbers that are too large or not finite, and tables nested too deep."""
    waiting: list[tuple[str, Any, int]] = [("$", data, 0)]
    while waiting:
        path, value, depth = waiting.pop()
        if isinstance(value, dict | list) and depth == MAX_DEPTH:
            yield Finding(path, f"is nested deeper than {MAX_DEPTH} tables")
        elif isinstance(value, dict):
            waiting += [(f"{path}.{key[:MAX_NAME]}", inner, depth + 1) for key, inner in value.items()]
        elif isinstance(value, list):
            waiting += [(f"{path}[{index}]", inner, depth + 1) for index, inner in enumerate(value)]
        elif isinstance(value, int | float) and not abs(value) <= LARGEST_NUMBER:
            # Comparisons with nan are false.
            yield Finding(path, "is no number that can be computed with")


def validate(model: type[Model], data: dict[str, Any], file: str) -> Model:
    """Validate a table; raises AuthoredFileError with every fault."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise AuthoredFileError(file, tuple(findings_of(error, model))) from error


def findings_of(error: ValidationError, model: type[BaseModel]) -> Iterator[Finding]:
    """Convert Pydantic's errors to paths and plain sentences: the first twenty, and how many more."""
    faults = error.errors(include_url=False, include_context=False)
    for fault in faults[:MOST_FINDINGS]:
        *above, last = fault["loc"] or ("",)
        is_field = fault["type"] in {"extra_forbidden", "missing"}
        path = "$" + "".join(map(_path_part, above)) + (f".{last}" if is_field else _path_part(last))
        message, given = fault["msg"].removeprefix("Value error, "), fault["input"]
        if fault["type"] == "extra_forbidden":
            message = _not_known(str(last), model, given)
        elif fault["type"] == "missing":
            message = "is missing" + _WHY_NEEDED.get(str(fault["loc"][-1]), "")
        elif fault["type"].startswith("union_tag"):
            path, message = f"{path}.type", _no_type(given)
        elif fault["type"] in {"model_type", "model_attributes_type"}:
            message = "must be a table" + (f": [{last}], not [[{last}]]" if isinstance(given, list) else "")
            if last in DRIVING and isinstance(given, list) and len(given) > 1:
                message = f"{len(given)} degrees of freedom: {ONE_DRIVING_LINK}"
        elif fault["type"] == "list_type":
            message = f"must be a list{_a_list(str(last), given)}"
        elif fault["type"] in {"too_long", "too_short"}:
            message = fault["msg"].replace("List should have", "must have").replace(" after validation", "")
            message += "; a number has a decimal point" if fault["type"] == "too_long" else ""
        elif fault["type"] == "string_pattern_mismatch" and isinstance(given, str):
            message = f"'{given[:MAX_NAME]}' is no name here: letters A-Z a-z and digits{look_alikes(given)}"
            path = path.removesuffix(".[key]")
        elif fault["type"] in {"float_type", "int_type"} and isinstance(given, str):
            message = "must be a number, without quotes"
        elif fault["type"] == "string_too_long":
            message = message.replace("String should have", "must have")
        yield Finding(
            path,
            message.replace("Input should be a valid", "must be a").replace("Input should be", "must be"),
        )
    if len(faults) > MOST_FINDINGS:
        yield Finding("$", f"and {counted(len(faults) - MOST_FINDINGS, 'more fault')}")


DRIVING = ("crank", "driving_slider", "driven_slider")
_EQUIVALENT = "by its equivalent linkage for the instant, see Cams and gears in docs/assignments.md"
_OTHER_KINDS = {
    ".*(cam(?!e)|follower|tappet).*": f"replace a cam {_EQUIVALENT}",
    ".*(gears?$|gear.?(pair|set|train|wheel)|planet|epicycl|pinion|belt|pulley|friction).*":
        f"a gear before the crank is its gear_ratio; replace a pair of gears between links {_EQUIVALENT}",
    ".*(geneva|maltese).*": 'a Geneva wheel: while the pin is in a slot, it is a slotted link, type = "RPR"',
    ".*(spring|damper|rope|cable|screw|spheric|cardan).*":
        "planmark solves plane mechanisms of rigid links, hinges and sliders",
    "triad|.*third.*|class.?iii|rr[rp].?[rp]+":
        "a group of more than two links: only groups of the second class are solved",
    "oldham.*|(scotch.?)?yoke|ppr|pp": 'a block in a yoke on a guide is type = "RPP"',
    "dyad|rr|bars?|rods?|rocker|lever": 'two links that meet in a joint are type = "RRR"',
    "cylinder|slott?ed.*|quick.?return": 'a block in the slot of a turning link is type = "RPR"',
    "prr|slider|piston|slider.?crank": 'a rod with a slider on a guide is type = "RRP"',
    "triangle|coupler|ternary|body": 'a third point of a link is type = "plate" or "point"',
    "(crank|driv(en|ing).?slider|driver|motor|second).?([2-9]|crank|driver|motor)":
        f"a second driving link makes 2 degrees of freedom: {ONE_DRIVING_LINK}",
}  # fmt: skip
"""Advice about kinds of parts that no file has, or has by another name; the names as regular expressions."""


def _other_kind(name: str) -> str:
    """Return advice about a kind of part that a file does not have by this name; empty if it means none."""
    word = name[:MAX_NAME]
    advice = (text for kind, text in _OTHER_KINDS.items() if re.fullmatch(kind, word.lower()))
    return next((f"'{word}': {text}" for text in advice), "")


_GROUP_TYPES = ("RRR", "RRP", "RPR", "PRP", "RPP", "plate", "point_on_line", "point")
_UNION_TAGS = {*_GROUP_TYPES, "str", "MechanismFile"}


def _no_type(table: object) -> str:
    """Describe what is wrong with a group's type."""
    given = table.get("type") if isinstance(table, dict) else None
    known = f"one of {', '.join(_GROUP_TYPES)}"
    if not isinstance(given, str):
        return f"is missing: it must be {known}"
    if other := _other_kind(given):
        return f"{other}; types are {', '.join(_GROUP_TYPES)}"
    near = near_names(given, _GROUP_TYPES, most=1)
    meant = f"; did you mean {near[0]}?" if near else ""
    return f"'{given[:MAX_NAME]}' is no type: it must be {known}{meant}{look_alikes(given)}"


def _a_list(name: str, given: object) -> str:
    """Explain how a list of tables or of numbers is written."""
    return f" of tables: [[{name}]], not [{name}]" if isinstance(given, dict) else ", in square brackets"


_WHY_NEEDED = {
    "side": ": without it two assemblies are possible, and the mechanism is never guessed",
}


def _path_part(part: str | int) -> str:
    if isinstance(part, int):
        return f"[{part}]"
    return "" if not part or part in _UNION_TAGS or part.startswith("function-") else f".{part}"


def _not_known(name: str, model: type[BaseModel], given: object) -> str:
    schema = model.model_json_schema()
    tables = (schema, *schema.get("$defs", {}).values())
    fields = {field for table in tables for field in table.get("properties", ())}
    if name in schema.get("properties", ()) and not isinstance(given, dict | list):
        return "belongs to the file, not to this table: write it above the first [table]"
    if name in fields:
        return "does not belong here: another kind of table has it; leave it out"
    if other := _other_kind(name):
        return other
    single = re.sub("ies$", "y", name).removesuffix("s")
    near = [single] if single in fields else near_names(name, sorted(fields), most=1)
    is_tables = isinstance(given, list) and given and isinstance(given[0], dict)
    meant = f" (did you mean {f'[[{near[0]}]]' if is_tables else near[0]}?)" if near else ""
    return f"is not known here; check its spelling{meant}"
