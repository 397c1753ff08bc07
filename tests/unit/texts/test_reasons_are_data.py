"""Reasons are data: no code takes a message apart, and sentences are made of codes and parameters alone."""

import ast
import pickle
import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

from grader.files import OutputError, create_whole, write_whole
from grader.language import LANGUAGES, tongue
from grader.records import Reason, Unread, of_error
from grader.texts.authored import AUTHORED, REMARKS
from grader.texts.clauses import CLAIMS, CLAUSES
from grader.texts.exports import EXPORTS
from grader.texts.failures import FAILURES
from grader.texts.faults import FAULTS
from grader.texts.problems import PROBLEMS
from grader.texts.reasons import FOLLOWS, FULL, HINTS, reason_sentence
from grader.texts.refusals import REFUSALS
from grader.texts.spoken import (
    ENGLISH,
    clause,
    clauses,
    failure,
    fault,
    message,
    sentence,
    told_of,
    unread_document,
)
from reference.errors import CallError, InputFileError

ROOT = Path(__file__).parents[3]
PROSE = {"message", "reason", "feedback"}
"""Fields that hold sentences."""
APART = {
    "split", "rsplit", "partition", "rpartition", "splitlines", "startswith", "endswith", "removeprefix",
    "removesuffix", "replace", "find", "index",
}  # fmt: skip
SEARCHES = {"match", "fullmatch", "search", "findall", "finditer", "sub"}
MAKERS = {
    **dict.fromkeys(("Reason", "_why", "_no_order", "TextError", "_at", "refused"), 0),
    **dict.fromkeys(("FaultError", "FormulaError", "_unknown"), 0),
    "Finding": 1,
}  # fmt: skip
"""Functions that make a reason or a finding, and which of their arguments is its code."""
PLACEHOLDER = re.compile(r"%\((\w+)\)s")


@cache
def trees() -> list[tuple[str, ast.Module]]:
    """Every module but those of sentences, by its path."""
    paths = sorted(path for top in ("grader", "reference") for path in (ROOT / top).rglob("*.py"))
    names = {path.relative_to(ROOT).as_posix(): path for path in paths}
    return [
        (name, ast.parse(path.read_text(encoding="utf-8")))
        for name, path in names.items()
        if not name.startswith("grader/texts/")
    ]


@cache
def nodes(tree: ast.AST) -> list[ast.AST]:
    """Every node of a module, gone through once for all tests."""
    return list(ast.walk(tree))


def _is_prose(node: ast.AST) -> bool:
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id in {"message", "sentence", "clause"}
    return isinstance(node, ast.Attribute) and node.attr in PROSE


def taken_apart(tree: ast.AST) -> Iterator[int]:
    """The lines on which a sentence is searched, cut or compared."""
    for node in nodes(tree):
        match node:
            case ast.Call(func=ast.Attribute(value=value, attr=attr)) if attr in APART and _is_prose(value):
                yield node.lineno
            case ast.Call(func=ast.Attribute(attr=attr), args=args) if attr in SEARCHES:
                yield from (node.lineno for one in args if _is_prose(one))
            case ast.Compare(left=left, comparators=[*others]):
                is_none = any(isinstance(one, ast.Constant) and one.value is None for one in others)
                yield from (node.lineno for one in (left, *others) if _is_prose(one) and not is_none)
            case ast.Subscript(value=value) if _is_prose(value):
                yield node.lineno


def test_no_code_takes_a_sentence_apart() -> None:
    assert [f"{name}:{line}" for name, tree in trees() for line in taken_apart(tree)] == []


def test_no_key_of_the_catalogues_is_made_at_run_time() -> None:
    made = []
    for name, tree in trees():
        for node in nodes(tree):
            match node:
                case ast.Call(func=ast.Name(id="N_"), args=[key]) if not isinstance(key, ast.Constant):
                    made.append(f"{name}:{node.lineno}")
                case ast.Call(func=ast.Attribute(attr="gettext" | "ngettext"), args=[key, *_]):
                    is_made = isinstance(key, ast.JoinedStr | ast.BinOp) or _is_prose(key)
                    made += [f"{name}:{node.lineno}"] if is_made else []
    assert made == []


def codes_made() -> Iterator[tuple[str, str]]:
    """Every code with which a reason is made, and its place in the source."""
    for name, tree in trees():
        for node in nodes(tree):
            match node:
                case ast.Call(func=ast.Name(id=maker), args=[*args]) if maker in MAKERS:
                    for one in ast.walk(ast.Tuple(args[MAKERS[maker] :][:1])):
                        if isinstance(one, ast.Constant) and re.fullmatch("[a-z][a-z0-9_]+", str(one.value)):
                            yield str(one.value), f"{name}:{node.lineno}"
                case ast.Call(func=ast.Name(id="LintFinding"), args=[_, code, *_], keywords=more):
                    whys = [one.value for one in more if one.arg == "why"]
                    told = [one.value for one in whys or [code] if isinstance(one, ast.Constant)]
                    yield from ((str(one), f"{name}:{node.lineno}") for one in told)
                case ast.Dict(keys=keys, values=values):
                    for key, value in zip(keys, values, strict=True):
                        is_why = isinstance(key, ast.Constant) and key.value in {"why", "advice"}
                        if is_why and isinstance(value, ast.Constant):
                            yield str(value.value), f"{name}:{node.lineno}"


def test_every_code_that_is_made_has_its_sentence() -> None:
    known = {*PROBLEMS, *HINTS, *CLAUSES, *FOLLOWS, *FAULTS, *EXPORTS}
    found = dict(codes_made())
    assert len(found) > 160
    assert {code: where for code, where in found.items() if code not in known} == {}


def has_words(parts: Iterable[ast.AST]) -> bool:
    """Tell whether two words stand in a text of these parts."""
    constants = [one for part in parts for one in ast.walk(part) if isinstance(one, ast.Constant)]
    return any(re.search("[a-z]{2,} [a-z]", str(one.value)) for one in constants)


def words_of_findings(tree: ast.AST) -> Iterator[int]:
    """The lines on which a finding or a fault is made with a text of the code itself."""
    for node in nodes(tree):
        match node:
            case ast.Call(func=ast.Name(id="Finding" | "LintFinding" | "FaultError" | "FormulaError")):
                parts = [*node.args, *(one.value for one in node.keywords)]
            case ast.Raise(exc=ast.Call(func=ast.Name(id="ValueError"), args=parts)):
                pass
            case _:
                continue
        if has_words(parts):
            yield node.lineno


def test_faults_of_authored_files_have_no_words_of_their_own() -> None:
    rooms = (
        "reference/authored/",
        "grader/rubric.py",
        "grader/tables/",
        "grader/printed/answer_sheet",
        "grader/authoring/",
    )
    found = [f"{name}:{line}" for name, tree in trees() for line in words_of_findings(tree)]
    assert [where for where in found if where.startswith(rooms)] == []


def test_every_sentence_of_authored_files_has_its_fault() -> None:
    said = {one.value for _, tree in trees() for one in nodes(tree) if isinstance(one, ast.Constant)}
    assert AUTHORED.keys() <= said
    assert all(FAULTS[code] is texts for code, texts in AUTHORED.items())
    assert AUTHORED.keys() & {*CLAIMS, *EXPORTS, *CLAUSES} == set()


def refusals_made() -> Iterator[tuple[str, str]]:
    """Every code with which a request is refused, and its place in the source."""
    before = {"RefusedError": "", "forbidden": "", "_refused": "", "missing": "no_"}
    for name, tree in trees():
        for node in nodes(tree) if name.startswith(("grader/web/", "grader/review/")) else ():
            match node:
                case ast.Call(func=ast.Name(id=maker), args=[*args]) if maker in before:
                    codes = [one.value for one in args if isinstance(one, ast.Constant)]
                    texts = [one for one in codes if isinstance(one, str)]
                    if texts and isinstance(args[-1], ast.Constant):
                        yield before[maker] + texts[-1], f"{name}:{node.lineno}"


def test_every_refusal_has_its_sentence() -> None:
    found = dict(refusals_made())
    assert len(found) > 50
    assert {code: where for code, where in found.items() if code not in REFUSALS} == {}


@pytest.mark.parametrize("lang", [lang for lang in LANGUAGES if lang != "en"])
def test_every_refusal_and_failure_is_told_in_every_language(lang: str) -> None:
    texts = (*REFUSALS.values(), *FAILURES.values())
    assert [text for text in texts if tongue(lang).gettext(text) == text] == []


def test_every_failure_has_its_sentence_and_every_sentence_its_failure() -> None:
    assert FAILURES.keys() & REFUSALS.keys() == set()
    said = {one.value for _, tree in trees() for one in nodes(tree) if isinstance(one, ast.Constant)}
    assert FAILURES.keys() | EXPORTS.keys() <= said
    for name, tree in trees():
        for node in nodes(tree):
            match node:
                case ast.Call(func=ast.Name(id="failure"), args=[_, *args]):
                    named = [one.value for one in ast.walk(ast.Tuple(args)) if isinstance(one, ast.Constant)]
                    assert [*filter(None, named), "item"][-1] in FAILURES, f"{name}:{node.lineno}"


BELOW_TEXTS = ("grader/files.py", "grader/language.py", "reference/")
"""Rooms that `texts` imports: their errors hold parameters beside their words."""
ERRORS = {"PlanmarkError", "CallError", "InputFileError", "OutputError", "InterruptedRunError"}


def words_of_errors(tree: ast.AST) -> Iterator[int]:
    """The lines on which an error is made whose message is, or holds, a text of the code itself."""
    told = {
        target.id: node.value
        for node in nodes(tree)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in nodes(tree):
        match node:
            case ast.Call(func=ast.Name(id=kind), args=[_, text, *_]) if kind in ERRORS:
                names = [one.id for one in ast.walk(text) if isinstance(one, ast.Name)]
                parts = [text, *(told[name] for name in names if name in told)]
                if has_words(parts):
                    yield node.lineno


def test_outside_of_texts_no_error_has_words_of_its_own() -> None:
    found = [f"{name}:{line}" for name, tree in trees() for line in words_of_errors(tree)]
    assert [where for where in found if not where.startswith(BELOW_TEXTS)] == []
    assert all(any(where.startswith(room) for where in found) for room in BELOW_TEXTS)


TOLD = {"notes", "note", "why", "missing", "unplaced", "withheld"}
"""Names for what an export tells."""


def words_told(tree: ast.AST) -> Iterator[int]:
    """The lines on which an export is given a note, or a reason, that is a text of the code itself."""
    for node in nodes(tree):
        match node:
            case ast.keyword(arg=str(name), value=value):
                parts = [value]
            case ast.Call(func=ast.Attribute(value=ast.Name(name) | ast.Attribute(attr=name)), args=parts):
                pass
            case ast.Assign(targets=[target, *_], value=value) | ast.AugAssign(target=target, value=value):
                inner = target.value if isinstance(target, ast.Subscript) else target
                name, parts = getattr(inner, "id", getattr(inner, "attr", "")), [value]
            case _:
                continue
        if name in TOLD and has_words(parts):
            yield parts[0].lineno


@pytest.mark.parametrize(
    ("seen_by", "code"),
    [
        (taken_apart, 'a.message.partition(" ")'),
        (taken_apart, '"no" in a.message'),
        (taken_apart, "re.match(x, a.reason)"),
        (taken_apart, "message(a)[:3]"),
        (taken_apart, "message(a).replace(x, y)"),
        (words_of_findings, 'Finding("$", "is missing here")'),
        (words_of_findings, 'FaultError("limit", limit=f"more than {most}")'),
        (words_of_findings, 'raise ValueError(f"has {count} of them")'),
        (words_of_errors, 'raise CallError("no", "there is none")'),
        (words_of_errors, 'raise OutputError("no", f"{path}: cannot be written")'),
        (words_of_errors, 'why = f"{path} is none"; raise InputFileError("no", why)'),
        (words_of_errors, 'why = "there is none"; raise PlanmarkError("no", f"{path}: {why}")'),
        (words_told, 'Delivery(x, notes=("look at it",))'),
        (words_told, 'sheet.notes.append(f"{count} are changed")'),
        (words_told, 'missing[student] = f"nobody in {table} has it"'),
        (words_told, 'notes += ["nobody is there"]'),
        (words_told, 'why = "nobody is there"'),
    ],
)
def test_what_takes_a_sentence_apart_and_a_texts_own_words_are_seen(
    seen_by: Callable[[ast.AST], Iterator[int]], code: str
) -> None:
    assert list(seen_by(ast.parse(code))) == [1]


def test_notes_and_reasons_of_exports_are_data() -> None:
    rooms = ("grader/lms/", "grader/cli/exporting", "grader/web/lti", "grader/web/instructors")
    found = [
        f"{name}:{line}" for name, tree in trees() if name.startswith(rooms) for line in words_told(tree)
    ]
    assert found == []


def test_an_error_of_a_room_below_has_the_words_of_its_sentence(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("")
    calls = (lambda: write_whole(taken / "a", ""), lambda: create_whole({taken: ""}), lambda: tongue("xx"))
    for call, romanian in zip(calls, ("nu se poate scrie", "există deja", "nu este o limbă"), strict=True):
        with pytest.raises((OutputError, CallError)) as told:
            call()
        assert told_of(told.value, ENGLISH) == told.value.message
        assert romanian in told_of(told.value, tongue("ro"))


def test_faults_below_a_sentence_are_told_in_the_readers_language_too() -> None:
    faults = [Reason("fields_missing", {"table_row": 3, "fields": 8, "columns": 9}), Reason("no_students")]
    error = failure(InputFileError, "worksheet", faults=faults, file="w.csv")
    assert pickle.loads(pickle.dumps(error)).faults == tuple(faults)  # noqa: S301 - its own
    assert error.message.splitlines()[1:] == [
        "  row 3: has 8 fields, the first line names 9 columns", "  it has no students",
    ]  # fmt: skip
    first, row, last = told_of(error, tongue("ro")).splitlines()
    assert first.startswith("w.csv: Moodle nu ar primi")
    assert (row[:12], last) == ("  rândul 3: ", "  nu conține studenți")


def test_a_failure_is_told_in_the_readers_language_with_its_numbers() -> None:
    error = failure(CallError, "maximum_differs", there=10.5, here=20)
    assert "is 10.5, the rubric's is 20" in error.message
    assert "acolo este 10,5, al baremului 20" in told_of(error, tongue("ro"))
    assert "в критериях 20" in told_of(error, tongue("ru"))
    told_of(failure(CallError, "folder_missing", folder=Path("\udcff")), tongue("ro")).encode()


@pytest.mark.parametrize("lang", LANGUAGES)
def test_every_code_has_a_sentence_in_every_language(lang: str) -> None:
    speaker = tongue(lang)
    for code, texts in PROBLEMS.items():
        told = sentence(Reason(code), speaker, brief=True)
        assert told, code
        assert lang == "en" or told != texts[-1], code
        assert not PLACEHOLDER.search(told), code
    for code in HINTS:
        assert reason_sentence(Reason(code), speaker, "full") not in {"", code}
    several = [text for code in (*FAULTS, *CLAIMS, *EXPORTS) for text in clauses(code)]
    several += [text for texts in REMARKS.values() for text in texts]
    for text in (*several, *CLAUSES.values(), *FULL.values()):
        assert lang == "en" or not PLACEHOLDER.sub("", text).strip() or speaker.gettext(text) != text


@pytest.mark.parametrize("code", sorted(PROBLEMS))
def test_of_a_problems_sentences_the_last_one_needs_nothing(code: str) -> None:
    *precise, least = PROBLEMS[code]
    assert not PLACEHOLDER.search(least)
    assert all(PLACEHOLDER.search(text) for text in precise)


@pytest.mark.parametrize(
    ("lang", "told"),
    [
        ("en", "The sheet could not be placed: only 63\u00a0% of the sheet is in the picture."),
        ("ro", "Poziția foii nu a putut fi stabilită: în imagine se află numai 63\u00a0% din foaie."),
        ("ru", "Не удалось определить положение листа: на изображении только 63\u00a0% листа."),
    ],
)
def test_numbers_and_clauses_are_said_in_the_readers_language(lang: str, told: str) -> None:
    refused = Reason("sheet_refused", {"why": "part_in_picture", "share_percent": 63})
    assert sentence(refused, tongue(lang)) == told


def test_a_fault_of_a_file_stands_behind_its_place_and_quotes_what_was_written() -> None:
    found = Reason("no_number", {"line": 3, "cell": "v_A", "text": "values"})
    assert fault(found) == "line 3, v_A: 'values' is no number"
    told = Reason("measurement_fault", {"why": found.code, **found.parameters}, "a.csv")
    assert message(told) == fault(found)
    assert sentence(told, tongue("ru")) == "строка 3, v_A: «values»: не число"


def test_without_its_parameters_a_problem_is_told_by_the_sentence_that_needs_none() -> None:
    assert sentence(Reason("squared_paper", {"pitch_px": 3}), ENGLISH) == PROBLEMS["squared_paper"][-1]
    assert message(Reason("brand_new")) == "brand_new"


def test_an_error_becomes_a_problem_with_its_parameters_and_its_own_words() -> None:
    error = InputFileError("pages_too_many", "a.pdf: 900 pages, more than 500", pages=900, most=500)
    problem = of_error(error, "a.pdf")
    assert (message(problem), problem.file) == (error.message, "a.pdf")
    assert "900" in sentence(problem, tongue("ro"))
    assert "more than" not in sentence(problem, tongue("ro"))


def test_what_was_not_read_keeps_its_reason_and_gains_code_and_parameters() -> None:
    written = unread_document(Unread("v_BA", Reason("no_stroke", {"start": "a", "end": "b"})))
    assert written.reason == "no stroke between a and b could be told apart"
    assert (written.code, written.parameters) == ("no_stroke", {"start": "a", "end": "b"})
    assert clause(Reason("by_similarity", {"node": "c"}), tongue("ru")) != ""
