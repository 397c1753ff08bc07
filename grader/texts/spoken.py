"""Sentences of reasons and problems in a language: numbers with their units, names as students know them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeVar, cast

from grader.documents import ProblemDocument, UnmatchedDocument, UnreadDocument
from grader.language import N_, NO_NAMES, ROOT_LANGUAGE, Tongue, tongue
from grader.records import Reason, Unread, Value, of_error
from grader.texts.authored import REMARKS
from grader.texts.clauses import CLAIMS, CLAUSES
from grader.texts.exports import EXPORTS
from grader.texts.failures import FAILURES
from grader.texts.faults import FAULTS, WHERE
from grader.texts.problems import ADVICE, PROBLEMS
from grader.texts.refusals import REFUSALS
from reference.errors import (
    MOST_FINDINGS,
    AuthoredFileError,
    Finding,
    MechanismError,
    PlanmarkError,
    writable,
)
from reference.quantities import sort_of, unit_of, vector_of_value

ENGLISH = tongue(ROOT_LANGUAGE)
SENTENCES = {**FAILURES, **REFUSALS}


class Coded(Protocol):
    """A record with a code and parameters: a `Reason`, or its form in a document."""

    @property
    def code(self) -> str:
        """The stable code."""

    @property
    def parameters(self) -> Mapping[str, float | str | Sequence[str]]:
        """Values used in its sentence."""


PLACES = {
    "mechanism": N_("the mechanism"),
    "velocity_plan": N_("the velocity plan"),
    "acceleration_plan": N_("the acceleration plan"),
    "force_plan": N_("the force plan of the group of {group}"),
    "driving_force_plan": N_("the force plan of the driving link"),
    "force_plans": N_("the set of force plans"),
    "F_i": N_("every inertia force"),
    "G_": N_("every weight"),
    "M_i": N_("every moment of inertia forces"),
    "directions": N_("the directions"),
    "lengths": N_("the lengths"),
    "scales": N_("the scales"),
    "values": N_("the values"),
}
CORNERS = {
    "upper_left": N_("the upper left corner"),
    "upper_right": N_("the upper right corner"),
    "lower_left": N_("the lower left corner"),
    "lower_right": N_("the lower right corner"),
}
AREAS = {
    "upper_left": N_("at the upper left"),
    "upper_middle": N_("at the top"),
    "upper_right": N_("at the upper right"),
    "middle_left": N_("at the left"),
    "middle": N_("in the middle"),
    "middle_right": N_("at the right"),
    "lower_left": N_("at the lower left"),
    "lower_middle": N_("at the bottom"),
    "lower_right": N_("at the lower right"),
}
"""Position of a flaw on the sheet."""
_AS_WRITTEN = {"text", "texts", "cell"}
"""Parameters in which no word stands for something else."""
_NOUNS = {"corners": CORNERS, "areas": AREAS}
"""Words for the codes in lists, by the parameter's name."""


def place(at: str, speaker: Tongue, names: Mapping[str, str] = NO_NAMES) -> str:
    """Return a node, vector, computed value, scale or figure as a sentence names it."""
    vector = vector_of_value(at)
    if vector is not None:
        return f"{names.get(vector, vector)}, {speaker.unit(unit_of(vector))}"
    return speaker.titled(PLACES, at, names) if sort_of(at) in PLACES else names.get(at, at)


# Parameters in words ------------------------------------------------------------------------------


def spoken(
    parameters: Mapping[str, float | str | Sequence[str]],
    speaker: Tongue,
    names: Mapping[str, str] = NO_NAMES,
) -> dict[str, str]:
    """Return parameters in words: `off_mm` becomes `off`, with its unit."""
    # `near_limit` names its quantity instead of a unit.
    unit_of_limit = {"length": "mm", "scale": "mm", "direction": "°"}.get(str(parameters.get("what", "")), "")
    unit = str(parameters.get("unit", unit_of_limit))
    said: dict[str, str] = {}
    for key, value in parameters.items():
        stem, _, suffix = key.rpartition("_")
        if isinstance(value, str):
            said[key] = value if key in _AS_WRITTEN else place(value, speaker, names)
        elif key == "students":
            said[key] = _some(cast("Sequence[str]", value), speaker)
        elif key in _AS_WRITTEN:
            said[key] = ", ".join(cast("Sequence[str]", value))
        elif not isinstance(value, int | float):
            words = _NOUNS.get(key, PLACES)
            said[key] = ", ".join(
                speaker.titled(words, one, names) if sort_of(one) in words else names.get(one, one)
                for one in value
            )
        elif suffix in _UNIT_WRITERS and stem:
            said[stem] = _UNIT_WRITERS[suffix](speaker, value)
        elif key == "confidence":
            said[key] = _UNIT_WRITERS["percent"](speaker, round(100.0 * value))
        elif isinstance(value, int):
            said[key] = str(value)
        else:
            said[key] = _real(speaker, value, unit)
    _say_clauses(parameters, said, speaker)
    claims = [speaker.gettext(CLAIMS[key][0]) % {"claim": said[key]} for key in parameters if key in CLAIMS]
    if claims:
        said["claims"] = "; ".join(claims)
    if {"declared", "expected"} <= parameters.keys():
        declared, expected = (cast("float", parameters[key]) for key in ("declared", "expected"))
        said["factor"] = _how_far_off(declared, expected, speaker)
    return said


MOST_STUDENTS = 20
AND_MORE = N_("%(names)s and %(more)s more")


def _some(names: Sequence[str], speaker: Tongue) -> str:
    """Return students in one line, of many only the first."""
    told, more = ", ".join(names[:MOST_STUDENTS]), len(names) - MOST_STUDENTS
    return told if more <= 0 else speaker.gettext(AND_MORE) % {"names": told, "more": more}


def filled(texts: Sequence[str], said: Mapping[str, str], speaker: Tongue) -> str:
    """Fill in the first of the texts whose parameters are all known; empty if there is none."""
    for text in texts:
        try:
            return speaker.gettext(text) % said
        except KeyError:
            continue
    return ""


def _say_clauses(parameters: Mapping[str, object], said: dict[str, str], speaker: Tongue) -> None:
    """Put clauses in the place of their codes; of a fault of a file also what is said behind its place."""
    for key in ("advice", "why"):
        texts = clauses(str(parameters.get(key, "")))
        if texts and (told := filled(texts, said, speaker)):
            said[key] = told
        elif texts:
            del said[key]
    if "why" in said and ("cell" in said or parameters["why"] in FAULTS):
        said["fault"] = _placed(said["why"], said, speaker)
        said.pop("line", None)


def clauses(code: str) -> Sequence[str]:
    """The texts of a clause, the most precise first; none for what is the code of no clause."""
    texts = FAULTS.get(code) or CLAIMS.get(code) or EXPORTS.get(code) or CLAUSES.get(code) or ()
    return [texts] if isinstance(texts, str) else texts


def _placed(text: str, said: Mapping[str, str], speaker: Tongue) -> str:
    """Return a fault behind its place: a path in a document, or a line, a column of it, or both."""
    line = filled(WHERE, said, speaker)
    return ": ".join(filter(None, (", ".join(filter(None, (line, said.get("cell", "")))), text)))


TOO_LARGE, TOO_SMALL = N_("%(times)s times too large"), N_("%(times)s times too small")
SHARE_TOO_LARGE, SHARE_TOO_SMALL = N_("%(share)s too large"), N_("%(share)s too small")
SEVERAL_TIMES = 1.5
"""From this factor on, an error of a scale is stated as a multiple, below it as a percentage."""


def _how_far_off(declared: float, right: float, speaker: Tongue) -> str:
    """Describe the error of a declared scale: "10 times too small", "5 % too large"."""
    factor = declared / right if right else 1.0
    ratio = max(factor, 1.0 / factor) if factor > 0.0 else 1.0
    if ratio >= SEVERAL_TIMES:
        text = TOO_LARGE if factor > 1.0 else TOO_SMALL
        return speaker.gettext(text) % {"times": speaker.trimmed(ratio, 1 if ratio < 20.0 else 0)}
    share = f"{speaker.number(100.0 * abs(factor - 1.0), 1)}\N{NO-BREAK SPACE}%"
    return speaker.gettext(SHARE_TOO_LARGE if factor > 1.0 else SHARE_TOO_SMALL) % {"share": share}


def _real(speaker: Tongue, value: float, unit: str) -> str:
    if unit == "mm":
        return speaker.quantity(value, 2, unit)
    if unit == "°":
        return f"{speaker.number(value, 2)}°"
    return speaker.value(value, unit)


def _with_unit(unit: str) -> Callable[[Tongue, float], str]:
    """Return a function that writes a number with a unit, whole numbers without decimals."""
    return lambda speaker, value: speaker.quantity(value, 0 if isinstance(value, int) else 1, unit)


_UNIT_WRITERS: dict[str, Callable[[Tongue, float], str]] = {
    "mm": _with_unit("mm"),
    "deg": lambda speaker, value: f"{speaker.number(value, 1)}°",
    "percent": _with_unit("%"),
    "dpi": _with_unit("dpi"),
    "mb": _with_unit("MB"),
    "points": lambda speaker, value: speaker.trimmed(value, 6),
    "number": lambda speaker, value: speaker.trimmed(float(f"{value:.2g}"), 6),
    "s": lambda speaker, value: f"{speaker.trimmed(value, 1)}\N{NO-BREAK SPACE}{speaker.unit('s')}",
}

# Problems -----------------------------------------------------------------------------------------

AT_PAGE, AT_LINE = N_("Page %(page)s: %(text)s"), N_("Line %(line)s: %(text)s")


def sentence(reason: Coded, speaker: Tongue, *, brief: bool = False) -> str:
    """Return the sentence of a problem (`brief`: the one without numbers); empty if its code has none.

    An error's own words (`detail`) are no sentence: `details` shows them beside it.
    """
    advice = ADVICE.get(reason.code, {}).get(str(reason.parameters.get("device")))
    texts = (*filter(None, [advice]), *PROBLEMS.get(reason.code, ()))
    said = spoken(reason.parameters, speaker)
    text = filled(texts[-1:] if brief else texts, said, speaker)
    also = PROBLEMS.get(str(reason.parameters.get("also", "")))
    if also and text and not brief:
        text = f"{text} {speaker.gettext(also[-1])}"
    for key, where in (("line", AT_LINE), ("page", AT_PAGE)):
        if key in said and text and not brief:
            text = speaker.gettext(where) % {key: said[key], "text": text}
    return text


def clause(reason: Coded, speaker: Tongue) -> str:
    """Return why something is not read or understood, as part of a sentence; the code if it has no words."""
    said, texts = spoken(reason.parameters, speaker), clauses(reason.code)
    chosen = next((text for text in texts if filled([text], said, speaker)), "")
    remarks = [one for key, one in REMARKS.items() if key in said and f"%({key})s" not in chosen]
    behind = "; ".join(filled(one, said, speaker) for one in remarks)
    return (filled([chosen], said, speaker) or reason.code) + (f" ({behind})" if behind else "")


def fault(reason: Coded, speaker: Tongue = ENGLISH) -> str:
    """Return a fault of a file that people wrote, behind its place: `line` and `cell` say which it is."""
    said = spoken(reason.parameters, speaker)
    if isinstance(reason, Finding):
        said |= {"cell": reason.path} | ({"line": str(reason.line)} if reason.line else {})
    return _placed(clause(reason, speaker), said, speaker)


MOST_CHARACTERS = 500
"""Longest line of a fault: a name in the file may be a megabyte long."""
MORE_LINES = N_("... and %(more)s more")


def lines_of(faults: Sequence[str], speaker: Tongue = ENGLISH) -> str:
    """Format faults as lines of a message: the first twenty, and how many more there are."""
    lines = [
        line[:MOST_CHARACTERS] + "..." * (len(line) > MOST_CHARACTERS) for line in faults[:MOST_FINDINGS]
    ]
    if len(faults) > MOST_FINDINGS:
        lines.append(speaker.gettext(MORE_LINES) % {"more": len(faults) - MOST_FINDINGS})
    return "\n".join(f"  {line}" for line in lines)


def _authored(error: AuthoredFileError, speaker: Tongue) -> str:
    """Return all faults of an authored file, and of the files with it."""
    files = [(one.file, [fault(each, speaker) for each in one.findings]) for one in (error, *error.others)]
    return "\n".join(f"{writable(file)}:\n{lines_of(told, speaker)}" for file, told in files)


def message(reason: Coded, speaker: Tongue = ENGLISH) -> str:
    """Return an error's own words, else the problem's sentence; its code if it has neither."""
    return str(reason.parameters.get("detail", "")) or sentence(reason, speaker) or reason.code


def refusal(reason: Reason, speaker: Tongue = ENGLISH, faults: Sequence[Reason] = ()) -> str:
    """Return a refused request's sentence; of an error its own words, in other languages its sentence."""
    text = SENTENCES.get(str(reason.parameters.get("cause", reason.code)))
    said = {key: _plain(one, speaker) for key, one in reason.parameters.items()}
    if faults:
        said["faults"] = lines_of([fault(one, speaker) for one in faults], speaker)
    if text and (told := filled([text], said, speaker)):
        return told
    return (speaker is not ENGLISH and sentence(reason, speaker)) or message(reason, speaker)


def _plain(value: Value, speaker: Tongue) -> str:
    if isinstance(value, tuple):
        return ", ".join(value)
    return speaker.trimmed(value, 6) if isinstance(value, float) else str(value)


Failed = TypeVar("Failed", bound=PlanmarkError)


def failure(
    kind: type[Failed], code: str, cause: str = "", /,
    faults: Any = (), **known: object,  # noqa: ANN401 - reasons; mappings of anything are spread behind it
) -> Failed:  # fmt: skip
    """Return an error that is told by the sentence of its cause, else of its code: see `FAILURES`.

    Arguments: `faults` are reasons listed below it; `known` is what it names, paths and the like become text.
    """
    told: dict[str, Value] = {"cause": cause} if cause else {}
    for name, one in known.items():
        told[name] = one if isinstance(one, int | float | tuple) else writable(str(one))
    error = kind(code, refusal(Reason(code, told), faults=faults), **told)
    error.faults = tuple(faults)
    return error


class RefusedError(PlanmarkError):
    """A request that is not answered: HTTP's `status`, a code, and `why` where several share the code.

    The sentence is that of `why`, else of the code, in `grader.texts.refusals` or of a problem.
    """

    exit_status = 1

    def __init__(self, status: int, code: str, why: str = "", /, **parameters: float | str) -> None:
        self.status, self.reason = status, Reason(why or code, parameters)
        super().__init__(code, refusal(self.reason), **parameters)


def told_of(error: PlanmarkError, speaker: Tongue) -> str:
    """Return the sentence of an error in a language."""
    if isinstance(error, AuthoredFileError):
        return _authored(error, speaker)
    if isinstance(error, MechanismError) and speaker is not ENGLISH:
        return clause(of_error(error), speaker)
    if told_in := getattr(error, "told", None):  # a table's error
        return str(told_in(speaker).message)
    reason = error.reason if isinstance(error, RefusedError) else of_error(error)
    return refusal(reason, speaker, error.faults)


def at_terminal(error: PlanmarkError, speaker: Tongue) -> str:
    """Return an error in a language, in English by its own words if it has any, behind its file."""
    if error.message and speaker is ENGLISH:
        return error.message
    file, said = str(error.parameters.get("file", "")), told_of(error, speaker)
    return said if file in said else f"{file}: {said}"


def in_english(error: PlanmarkError) -> str:
    """Return an error as a terminal shows it in English."""
    return at_terminal(error, ENGLISH)


# Documents ----------------------------------------------------------------------------------------


def problem_documents(problems: Sequence[Reason]) -> Iterator[ProblemDocument]:
    """Convert problems to documents."""
    for one in problems:
        yield ProblemDocument(
            code=one.code, message=message(one), parameters=as_json(one.parameters), file=one.file
        )


def unmatched_document(problem: Reason, page: int | None = None) -> UnmatchedDocument:
    """Convert a problem of a page or file without an owner to a document: the page in a field of its own."""
    known = {key: value for key, value in problem.parameters.items() if page is None or key != "page"}
    return UnmatchedDocument(
        file=problem.file or "", page=page, code=problem.code, message=message(Reason(problem.code, known)),
        parameters=as_json(known),
    )  # fmt: skip


def unread_document(gap: Unread) -> UnreadDocument:
    """Convert a vector or node that was not read to a document."""
    reason = gap.reason
    return UnreadDocument(
        name=gap.name, reason=clause(reason, ENGLISH), code=reason.code, parameters=as_json(reason.parameters)
    )


def told(reason: Reason, speaker: Tongue) -> dict[str, Any]:
    """Convert a reason of an export to JSON values, with its sentence in a language."""
    return {"code": reason.code, "message": clause(reason, speaker), "parameters": as_json(reason.parameters)}


def as_json(parameters: Mapping[str, Value]) -> dict[str, float | str | list[str]]:
    """Convert parameters to JSON values."""
    return {key: list(value) if isinstance(value, tuple) else value for key, value in parameters.items()}
