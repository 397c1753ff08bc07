"""Authored files: mechanisms and assignments in TOML, validated, with all faults of a file at once."""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
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
from reference.authored.formula import Formula
from reference.errors import (
    MOST_FINDINGS,
    AuthoredFileError,
    FaultError,
    Faults,
    Finding,
    Parameter,
    look_alikes,
    near_names,
    nearest,
)

LENGTH_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
MAX_BYTES = 200_000
"""Twenty times the largest file that comes with the program."""
MAX_DEPTH = 12
"""Three times as deep as the tables of the formats go."""
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
        raise FaultError("no_formula")
    return formula.parse(value)


def _check_joint(name: str) -> str:
    if not (name.isalnum() and name.isascii()) or not name[0].isupper() or name.lower() in {"o", "n"}:
        # A joint's image in the plans is its name in lower case: the two must differ.
        raise FaultError("no_joint_name", text=name, **look_alikes(name))
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
            raise FaultError("no_side", text=str(value), names=words)
        try:
            return SideText(words, _read_formula(value))
        except FaultError as error:
            raise FaultError("side_or_formula", sides=words, why=error.code, **error.parameters) from error

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
ThreeJoints = Annotated[list[Joint], Field(min_length=3, max_length=3)]
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


def load(model: type[Model], path: Path, unknown: Faults | None = None) -> Model:
    """Read and validate one authored file.

    Raises AuthoredFileError with every fault found, each with its path in the file.

    Arguments: `unknown` gathers the keys that the file cannot have; what is returned is then without them.
    """
    return validate(model, table_of(path), str(path), unknown)


def table_of(path: Path) -> dict[str, Any]:
    """Return the table that an authored file holds; raises AuthoredFileError if it holds none."""
    text = text_of(path)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # Besides TOMLDecodeError: numbers of thousands of digits, tables nested a thousand deep.
        raise AuthoredFileError(str(path), (_no_toml(error, text),)) from error
    faults = tuple(_check_tree(data))
    if faults:
        raise AuthoredFileError(str(path), faults)
    return data


_REMEDIES = {
    r"[^=]*=\s*[-+]?\d+,\d": "decimal_point",
    r"[^=]*=\s*[\d.+-]+\s*[^\d\s#]": "number_alone",
    r'[^"]*"([^"]*"[^"]*")*[^"]*$': "quote_unclosed",
    r"[^=]*=\s*($|#)": "value_missing",
    r'.*"[^"]*\\': "path_quotes",
    r"[^=]*=\s*(?!true\b|false\b)[^\W\d]|.*[“”„«]": "text_unquoted",
    r"\[|[^=]*=\s*[\[{]": "bracket_unclosed",
}
"""The most likely remedy for a line that is not TOML, by its pattern."""


def _no_toml(error: Exception, text: str) -> Finding:
    """Report invalid TOML with the faulty line and the most likely remedy: the parser's words are English."""
    if isinstance(error, RecursionError):
        return Finding("$", "nested", {"most": MAX_DEPTH})
    if not isinstance(error, tomllib.TOMLDecodeError):
        return Finding("$", "number_unusable")
    lines = [one.strip() for one in text.split("\n")]
    found = re.search(r" \(at line (\d+), column \d+\)", str(error))
    number = int(found[1]) if found else text.rstrip().count("\n") + 1
    line, above = lines[number - 1], lines[: number - 1]
    if table := re.match(r"\[+([^\[\]]+)\]", line):
        again = re.compile(rf"\[+\s*{re.escape(table[1].strip())}\s*\]")
        # Of [body] and [[body]], the one that is to be changed is at fault.
        for other in [other for other, one in enumerate(above, 1) if again.match(one)][-1:]:
            first, second = (number, other) if not line.startswith("[[") else (other, number)
            told = {"text": lines[first - 1], "name": table[1].strip(), "other": second}
            return Finding("", "not_toml", {**told, "advice": "two_brackets"}, first)
    key, sign, _ = line.partition("=")
    start = max((at for at, one in enumerate(above) if one.startswith("[")), default=0)
    if sign and key.strip() in {one.partition("=")[0].strip() for one in above[start:]}:
        remedy = "key_twice"
    else:
        remedies = (code for pattern, code in _REMEDIES.items() if re.match(pattern, line))
        remedy = next(remedies, "line_form")
    return Finding("", "not_toml", {"text": line[:MAX_NAME], "advice": remedy}, number)


def text_of(path: Path) -> str:
    """Return the text of an authored file or of a table beside it; raises AuthoredFileError without one."""
    try:
        return _content_of(path).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise AuthoredFileError(str(path), (Finding("$", "no_such_file"),)) from error
    except OSError as error:
        raise AuthoredFileError(
            str(path), (Finding("$", "not_readable", {"error": str(error.strerror)}),)
        ) from error
    except UnicodeDecodeError as error:
        raise AuthoredFileError(str(path), (Finding("$", "text_not_utf8"),)) from error


def _content_of(path: Path) -> bytes:
    """Return a file's bytes, up to the largest authored size; raises OSError or AuthoredFileError."""
    if path.exists() and not path.is_file():
        found = Finding("$", "no_file")
    else:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            found = Finding("$", "file_large", {"most": MAX_BYTES // 1000})
        elif _ENDLESS_KEY.search(content):
            found = Finding("$", "nested", {"most": MAX_DEPTH})
        else:
            return content
    raise AuthoredFileError(str(path), (found,))


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
            yield Finding(path, "nested", {"most": MAX_DEPTH})
        elif isinstance(value, dict):
            waiting += [(f"{path}.{key[:MAX_NAME]}", inner, depth + 1) for key, inner in value.items()]
        elif isinstance(value, list):
            waiting += [(f"{path}[{index}]", inner, depth + 1) for index, inner in enumerate(value)]
        elif isinstance(value, int | float) and not abs(value) <= LARGEST_NUMBER:
            # Comparisons with nan are false.
            yield Finding(path, "number_unusable")


def validate(model: type[Model], data: dict[str, Any], file: str, unknown: Faults | None = None) -> Model:
    """Validate a table; raises AuthoredFileError with every fault. Arguments: `unknown` as for `load`."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        found, faults = tuple(findings_of(error, model)), _faults_of(error)
        missing = [fault["loc"] for fault in faults if fault["type"] == "missing"]
        extra = [fault["loc"] for fault in faults if fault["type"] == "extra_forbidden"]
        if unknown is None or not extra or len(missing) + len(extra) < len(faults):
            raise AuthoredFileError(file, found) from error
        unknown.add(Path(file), found)
        for place in extra:
            _leave_out(data, place, [str(loc[-1]) for loc in missing if loc[:-1] == place[:-1]])
    return validate(model, data, file)


def _leave_out(data: Any, place: Sequence[str | int], missing: list[str]) -> None:  # noqa: ANN401 - TOML's
    """Take an unknown key out of its table, or name it as the missing one whose misspelling it is.

    Arguments: `place` is Pydantic's, which also names kinds of tables.
    """
    *above, key = place
    for part in filter(_path_part, above):
        data = data[part]
    value = data.pop(key)
    for meant in near_names(str(key), missing, most=1):
        data[meant] = value


def findings_of(error: ValidationError, model: type[BaseModel]) -> Iterator[Finding]:
    """Convert Pydantic's errors to findings: the first twenty, and how many more."""
    faults = _faults_of(error)
    told = faults if len(faults) <= MOST_FINDINGS else faults[: MOST_FINDINGS - 1]
    for fault in told:
        *above, last = fault["loc"] or ("",)
        is_field = fault["type"] in {"extra_forbidden", "missing"}
        path = "$" + "".join(map(_path_part, above)) + (f".{last}" if is_field else _path_part(last))
        if fault["type"].startswith("union_tag"):
            path = f"{path}.type"
        yield _fault_of({**fault}, str(last), model).at(path.removesuffix(".[key]"))
    if len(faults) > len(told):
        yield Finding("$", "more_faults", {"count": len(faults) - len(told)})


def _faults_of(error: ValidationError) -> list[Mapping[str, Any]]:
    """Return Pydantic's errors without those of a name that could stand where a table does."""
    faults = error.errors(include_url=False)
    return [one for one in faults if one["loc"][-1:] != ("str",) or not isinstance(one["input"], dict)]


_TYPES = {
    "literal_error": "one_of", "enum": "one_of", "greater_than": "limit", "greater_than_equal": "limit",
    "less_than": "limit", "less_than_equal": "limit", "finite_number": "number_unusable",
    "float_type": "no_number", "int_type": "no_whole_number", "int_from_float": "no_whole_number",
    "string_type": "no_quotes", "bool_type": "true_or_false", "dict_type": "must_be_table",
    "model_type": "must_be_table", "list_type": "must_be_list", "tuple_type": "must_be_list",
    "string_too_long": "too_long", "string_too_short": "cell_empty",
    "too_long": "list_long", "too_short": "list_short",
}  # fmt: skip
"""Codes of Pydantic's errors that need no more than their limits."""
_LIMITS = {"min_length": "least", "max_length": "most", "actual_length": "count"}
_MISSING = {"side": "side_missing"}
_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


def _fault_of(fault: Mapping[str, Any], last: str, model: type[BaseModel]) -> FaultError:
    """Return one of Pydantic's errors, at the key `last`, with its code."""
    kind, given, known = fault["type"], fault["input"], fault.get("ctx", {})
    if isinstance(fault_of_value := known.get("error"), FaultError):
        return fault_of_value
    match kind:
        case "extra_forbidden":
            return _not_known(last, model, given)
        case "missing":
            return FaultError(_MISSING.get(last, "key_missing"))
        case "union_tag_not_found" | "union_tag_invalid":
            return _no_type(given)
        case "model_type" if last in DRIVING and isinstance(given, list) and len(given) > 1:
            return FaultError("drivers")
        case "string_pattern_mismatch" if isinstance(given, str):
            return FaultError("no_name", text=given[:MAX_NAME], **look_alikes(given))
        case "float_type" | "int_type" if isinstance(given, str):
            return FaultError("number_in_quotes")
    told: dict[str, Parameter] = {name: known[key] for key, name in _LIMITS.items() if key in known}
    if isinstance(given, dict | list):
        told["name"] = last
    elif given is not None:
        told["text"] = str(given)[:MAX_NAME]
    for key in _SIGNS.keys() & known.keys():
        told["limit"] = f"{_SIGNS[key]} {known[key]:g}"
    if "expected" in known:
        told["names"] = known["expected"].replace(" or ", ", ")
    return FaultError(_TYPES.get(kind, "other_form"), **told, error=fault["msg"])


DRIVING = ("crank", "driving_slider", "driven_slider")
_OTHER_KINDS = {
    ".*(cam(?!e)|follower|tappet).*": "kind_cam",
    ".*(gears?$|gear.?(pair|set|train|wheel)|planet|epicycl|pinion|belt|pulley|friction).*": "kind_gears",
    ".*(geneva|maltese).*": "kind_geneva",
    ".*(spring|damper|rope|cable|screw|spheric|cardan).*": "kind_not_rigid",
    ".*third.*|class.?iii|rr[rp].?[rp]+": "kind_class",
    "oldham.*|(scotch.?)?yoke|ppr|pp": "kind_yoke",
    "dyad|rr|bars?|rods?|rocker|lever": "kind_links",
    "cylinder|slott?ed.*|quick.?return": "kind_slot",
    "prr|slider|piston|slider.?crank": "kind_slider",
    "triangle|coupler|ternary|body": "kind_point",
    "(crank|driv(en|ing).?slider|driver|motor|second).?([2-9]|crank|driver|motor)": "kind_driver",
}  # fmt: skip
"""Codes of advice about kinds of parts that no file has, or has by another name; the names as regular
expressions."""


def _other_kind(name: str, **known: Parameter) -> FaultError | None:
    """Return advice about a kind of part that a file does not have by this name; None if it means none."""
    word = name[:MAX_NAME]
    code = next((code for kind, code in _OTHER_KINDS.items() if re.fullmatch(kind, word.lower())), None)
    return FaultError(code, text=word, **known) if code else None


_GROUP_TYPES = ("RRR", "RRP", "RPR", "PRP", "RPP", "triad", "plate", "point_on_line", "point")
_UNION_TAGS = {*_GROUP_TYPES, "str", "MechanismFile"}


def _no_type(table: object) -> FaultError:
    """Return what is wrong with a group's type."""
    given = table.get("type") if isinstance(table, dict) else None
    if not isinstance(given, str):
        return FaultError("key_missing", types=_GROUP_TYPES)
    if other := _other_kind(given, types=_GROUP_TYPES):
        return other
    known = nearest(given, _GROUP_TYPES) | look_alikes(given)
    return FaultError("no_type", text=given[:MAX_NAME], types=_GROUP_TYPES, **known)


def _path_part(part: str | int) -> str:
    if isinstance(part, int):
        return f"[{part}]"
    return "" if not part or part in _UNION_TAGS or part.startswith("function-") else f".{part}"


def _not_known(name: str, model: type[BaseModel], given: object) -> FaultError:
    schema = model.model_json_schema()
    tables = (schema, *schema.get("$defs", {}).values())
    fields = {field for table in tables for field in table.get("properties", ())}
    if name in schema.get("properties", ()) and not isinstance(given, dict | list):
        return FaultError("of_the_file")
    if name in fields:
        return FaultError("of_another_table")
    if other := _other_kind(name):
        return other
    single = re.sub("ies$", "y", name).removesuffix("s")
    near = [single] if single in fields else near_names(name, sorted(fields), most=1)
    if not near:
        return FaultError("key_unknown")
    is_tables = isinstance(given, list) and given and isinstance(given[0], dict)
    return FaultError("key_unknown", near=f"[[{near[0]}]]" if is_tables else near[0])
