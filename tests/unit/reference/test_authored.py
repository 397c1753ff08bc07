"""Authored files: every fault at once, each with its path and what would be right."""

import copy
import json
import os
import random
import tomllib
from pathlib import Path

import numpy as np
import pytest

from grader.texts.spoken import in_english
from reference.authored.assignment import (
    Assignment,
    AssignmentFile,
    Variant,
    _check_formulas,
    built_in,
    library,
    load_assignment,
)
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import load, validate
from reference.drawing.canvas import svg
from reference.drawing.sheets import reference_drawing
from reference.errors import AuthoredFileError, CallError, PlanmarkError
from reference.mechanism import PointOnLine
from reference.plan import exact_plan
from tests import every_group
from tests.examples import slow
from tests.fuzz.shaped import shaped
from tests.told import by_path, tells


def table(name: str) -> dict:
    return tomllib.loads((library() / name).read_text(encoding="utf-8"))


@pytest.fixture
def mechanism() -> dict:
    return copy.deepcopy(table("pump.mechanism.toml"))


@pytest.fixture
def assignment(tmp_path: Path):
    """Writes an assignment beside a copy of the pump's mechanism, with text replaced."""

    def write(*changes: tuple[str, str], mechanism: tuple[tuple[str, str], ...] = ()) -> Path:
        for name, edits in (("pump.assignment.toml", changes), ("pump.mechanism.toml", mechanism)):
            text = (library() / name).read_text(encoding="utf-8")
            for old, new in edits:
                assert old in text
                text = text.replace(old, new, 1)
            (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / "pump.assignment.toml"

    return write


def findings(model, data) -> dict[str, str]:
    with pytest.raises(AuthoredFileError) as error:
        validate(model, data, "the file")
    assert error.value.exit_status == 2
    return by_path(error.value.findings)


def test_all_faults_of_a_file_are_told_at_once_each_with_its_path(mechanism):
    mechanism["crank"]["lenght"] = mechanism["crank"].pop("length")
    mechanism["length_unit"] = "inch"
    mechanism["group"][0]["side"] = "above"
    mechanism["group"][1]["lengths"] = [20]
    mechanism["group"][2]["guide"]["angle_deg"] = "__import__('os')"
    mechanism["ground"]["O2"] = [0, True]
    told = findings(MechanismFile, mechanism)
    assert set(told) == {
        "$.crank.length",
        "$.crank.lenght",
        "$.length_unit",
        "$.group[0].side",
        "$.group[1].lengths",
        "$.group[2].guide.angle_deg",
        "$.ground.O2[1]",
    }
    assert told["$.crank.length"] == "is missing"
    assert "did you mean length?" in told["$.crank.lenght"]
    assert "sides are left, right" in told["$.group[0].side"]
    assert "unknown name __import__" in told["$.group[2].guide.angle_deg"]
    assert "a number or a formula" in told["$.ground.O2[1]"]


def test_a_side_that_is_no_formula_is_told_with_the_reason(mechanism):
    mechanism["group"][0]["side"] = "1,5"
    told = findings(MechanismFile, mechanism)["$.group[0].side"]
    assert told.startswith("must be one of left, right, or a formula: ")
    assert "decimal" in told


@pytest.mark.parametrize("name", ["O", "N", "b", "1A", "A-B", "", "ABCDE"])
def test_a_joint_needs_a_name_that_plans_can_carry(mechanism, name):
    mechanism["group"][0]["node"] = name
    assert list(findings(MechanismFile, mechanism)) == ["$.group[0].node"]


def test_bad_toml_a_missing_file_and_text_of_another_encoding_are_told(tmp_path):
    bad, other = tmp_path / "bad.toml", tmp_path / "other.toml"
    bad.write_text("id = \n", encoding="utf-8")
    other.write_bytes("title = 'Механизм'".encode("cp1251"))
    for path, words in (
        (bad, "is not TOML"),
        (other, "is not UTF-8"),
        (tmp_path / "no.toml", "no such file"),
    ):
        with pytest.raises(AuthoredFileError, check=tells(words)) as error:
            load(MechanismFile, path)
        assert str(path) in str(error.value)
    with pytest.raises(AuthoredFileError, check=tells("cannot be read")):
        load(MechanismFile, tmp_path)


@pytest.mark.parametrize(
    ("text", "line", "other"),
    [("[body]\nm = 1\n[[body]]", 1, 3), ("[[body]]\nm = 1\n[body]", 3, 1), ("[body]\nm = 1\n[body]", 3, 1)],
)
def test_of_a_table_that_stands_twice_the_line_to_change_is_named(tmp_path, text, line, other):
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    words = rf"line {line}: .*\[body\] .*on line {other}, too: write \[\[body\]\]"
    with pytest.raises(AuthoredFileError, check=tells(words)):
        load(MechanismFile, path)


def test_an_unknown_assignment_is_told_with_the_built_in_ones():
    built_in = (
        "engine, piston, press, press-all, press-forces, pump, pump-230, pump-collinear, pump-forces, shaper"
    )
    with pytest.raises(CallError, check=tells(f"built in are {built_in}")):
        load_assignment("pmup")
    with pytest.raises(AuthoredFileError, check=tells("no such file")):
        load_assignment("nowhere/my.assignment.toml")


@pytest.mark.parametrize("name", built_in())
def test_every_built_in_assignment_assembles_for_every_variant(name):
    assignment = load_assignment(name)
    plan = exact_plan(assignment, assignment.variants())
    assert len(plan.variants) == len(assignment.variants())


def test_an_edited_copy_beside_its_mechanism_is_an_assignment(assignment):
    path = assignment(mechanism=(("length = 30 ", "length = 29 "),))
    edited = load_assignment(path)
    assert edited.mechanism([edited.variant(1)]).crank.length_m[0] == 0.29


DRAWN = 3
"""The number of plans of damaged files that are drawn as well."""


def files(name: str) -> tuple[dict, dict]:
    """An assignment and its mechanism."""
    if name == "every group":
        return every_group.assignment_table(), every_group.mechanism_table()
    return table(f"{name}.assignment.toml"), table(f"{name}.mechanism.toml")


@pytest.mark.parametrize(
    "name", ["pump", "engine", "pump-collinear", "shaper", "piston", *slow("press", "every group")]
)
def test_a_damaged_file_gives_a_plan_or_a_told_error_and_nothing_else(name):
    rng = random.Random(name)
    own, mechanism = files(name)
    whole = json.dumps({**own, "mechanism": mechanism}).encode()
    solved = 0
    for _ in range(150):
        try:
            file = validate(AssignmentFile, json.loads(shaped(whole, rng)), "the file")
            if not isinstance(file.mechanism, MechanismFile) or list(check_mechanism(file.mechanism)):
                continue
            assignment = Assignment(file, file.mechanism, Path("the file"))
            if _check_formulas(assignment, Path("the file")).errors:
                continue
            plan = exact_plan(assignment, assignment.variants()[:3])
        except (PlanmarkError, UnicodeDecodeError):  # a file in another encoding is no text
            continue
        assert all(np.all(np.isfinite(vector)) for vector in plan.vectors_si.values())
        if solved < DRAWN:
            assert svg([sheet.shapes for sheet in reference_drawing(assignment, plan)])
        solved += 1
    assert solved >= DRAWN


PHI = ("phi_deg =", "angle_deg ="), ('"phi_deg"', '"angle_deg"')
CRANK_MM, LAST = "crank_mm = 60", "to = 30"


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ([('"30 + 2*n"', '"30 + 2*m"')], "$.variant.values.phi_deg", "unknown name m"),
        (PHI, "$.crank.angle_deg", "unknown name phi_deg"),
        ([("from = 1, to = 30", "from = 30, to = 1")], "$.variant.n", "the range is empty"),
        ([("from = 1, to = 30", "form = 1, to = 30")], "$.variant.n.from", r"form: .*did you mean from\?"),
        *(
            ([(LAST, f"to = {last}")], "$.variant", "variants, more than 10000")
            for last in ("10_001", "9223372036854775807", "1" + "0" * 30)
        ),
        ([(LAST, "to = 1000 }\nposition = { from = 1, to = 11")], "$.variant", "has 11000 variants"),
        ([('kv = "omega * kL"', "kv = 0")], "$.scales.kv", r"'0' \(kv\) must be > 0 "),
        (
            [('kv = "omega * kL"', 'kv = "5 - n"')],
            "$.scales.kv",
            r"'5 - n' \(kv\) must be > 0 \(for n = 5 and",
        ),
        ([('kv = "omega * kL"', 'kv = "1e300*kL"')], "$.scales.kv", r"\(kv\) must be < 1e\+09"),
        ([(CRANK_MM, "crank_mm = 0")], "$.scales.kL", "does not give a finite number"),
        ([(CRANK_MM, "crank_mm = -60")], "$.scales.kL", r"'crank_m / crank_mm' \(kL\) must be > 0"),
        ([(CRANK_MM, "crank_mm = 1e400")], "$.scales.crank_mm", None),
        ([(CRANK_MM, "crank_mm = nan")], "$.scales.crank_mm", None),
        ([(CRANK_MM, "crank_mm = 0x" + "f" * 5000)], "$.scales.crank_mm", None),
        ([(CRANK_MM, "crank_mm = " + "9" * 5000)], "$", None),
        ([(CRANK_MM, "crank_mm = 1979-05-27")], "$.scales.crank_mm", None),
        ([(CRANK_MM, "crank_mm = " + "[" * 50 + "]" * 50)], "$.scales.crank_mm" + "[0]" * 10, None),
        ([(CRANK_MM, "crank_mm = " + "[" * 5000)], "$", None),
        ([(CRANK_MM, "crank_mm" + ".a" * 20_000 + " = 1")], "$", None),
        ([(CRANK_MM, 'crank_mm = "' + "9" * 180 + '**16"')], "$.scales.kL", None),
        ([(CRANK_MM, 'crank_mm = "n\\u0000"')], "$.scales.crank_mm", None),
        ([(CRANK_MM, "crank_mm = 60\0")], "line 45", None),
        ([('mechanism = "pump"', f'mechanism = "{"p" * 300}"')], "$.mechanism", None),
        ([('mechanism = "pump"', 'mechanism = "/dev/zero"')], "$.mechanism", None),
        ([('mechanism = "pump"', 'mechanism = "p\\u0000"')], "$.mechanism", None),
    ],
)
def test_a_fault_of_an_assignment_is_told_at_its_path_in_few_words(assignment, changes, path, words):
    with pytest.raises(AuthoredFileError, check=tells(words)) as error:
        load_assignment(assignment(*changes))
    assert next(iter(by_path(error.value.findings))) == path
    assert len(in_english(error.value)) < 2000


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('pins = ["A", "O2"]', 'pins = ["A", "O9"]', r"pump\.mechanism\.toml.*\n.*O9 is not placed"),
        ("length = 20", 'length = "20 - n"', "must be > 0"),
        ("length = 30 ", "length = 1e-12 ", "must be >= 1e-09 m"),
        ("length = 30 ", "length = 1e300 ", "must be <= 1e"),
    ],
)
def test_a_fault_of_the_mechanism_names_the_mechanisms_file(assignment, old, new, words):
    with pytest.raises(AuthoredFileError, check=tells(words)) as error:
        load_assignment(assignment(mechanism=((old, new),)))
    assert error.value.file.endswith("pump.mechanism.toml")


def test_no_more_faults_are_told_than_a_person_reads(assignment):
    unknown = "".join(f"key{number} = 1\n" for number in range(2000))
    with pytest.raises(AuthoredFileError) as error:
        load_assignment(assignment(("\n[title]", f"\n{unknown}\n[title]")))
    assert len(in_english(error.value)) < 5000
    assert in_english(error.value).endswith("more faults: 1981")


def test_a_file_larger_than_anybody_writes_is_refused(assignment):
    path = assignment()
    with path.open("a", encoding="utf-8") as file:
        file.write("#" * 300_000)
    with pytest.raises(AuthoredFileError, check=tells("is larger than")):
        load_assignment(path)


@pytest.mark.parametrize(
    ("n", "position", "code"), [(None, None, "n_needed"), (31, None, "n_range"), (0, None, "n_range")]
)
def test_a_variant_that_there_is_not_is_refused(n, position, code):
    with pytest.raises(CallError) as error:
        load_assignment("pump").variant(n, position)
    assert error.value.code == code


def test_a_file_changed_on_disk_is_read_again(assignment):
    path = assignment()
    assert len(load_assignment(path).variants()) == 30
    path.write_text(path.read_text(encoding="utf-8").replace("to = 30", "to = 12"), encoding="utf-8")
    os.utime(path, ns=(1, 1))
    assert len(load_assignment(path).variants()) == 12


def test_a_point_given_on_its_base_divides_it():
    point = {"type": "point", "node": "M", "base": ["A", "B"], "link": "6", "at": [140, 0]}
    group = every_group.mechanism(point).groups[-1]
    assert isinstance(group, PointOnLine)
    np.testing.assert_allclose(group.ratio, 140 / 350, rtol=1e-15)


def test_names_that_are_no_table_are_a_fault_of_the_file():
    data = {**every_group.assignment_table(), "mechanism": every_group.mechanism_table()}
    assert set(findings(AssignmentFile, {**data, "names": 3})) == {"$.names"}


def test_a_variant_is_told_by_what_it_has():
    assert str(Variant(7, 2)) == "n = 7, position = 2"
    assert str(Variant(position=2)) == "position = 2"
    assert str(Variant()) == "the only variant"


def test_texts_fall_back_to_english():
    assert load_assignment("pump").file.title.in_language("de").startswith("Pump")
    assert load_assignment("pump").file.title.in_language("ro").startswith("Mecanism")
    assert isinstance(load_assignment("pump").file, AssignmentFile)


@pytest.mark.parametrize(
    ("text", "line", "remedy"),
    [
        ("a = \nb = 1\n", 1, "value_missing"),
        ("a = 0,5\n", 1, "decimal_point"),
        ("a = 5 mm\n", 1, "number_alone"),
        ("a = left\n", 1, "text_unquoted"),
        ('a = "left\n', 1, "quote_unclosed"),
        ('a = "C:\\Users"\n', 1, "path_quotes"),
        ("a = 1\na = 2\n", 2, "key_twice"),
        ("[t]\na = 1\n[u]\na = 2\na = 3", 5, "key_twice"),
        ("a = [1, 2\n", 1, "bracket_unclosed"),
        ("a 1\n", 1, "line_form"),
    ],
)
def test_what_is_no_toml_is_told_with_its_line_and_a_remedy_and_none_of_the_parsers_words(
    tmp_path, text, line, remedy
):
    (path := tmp_path / "bad.toml").write_text(text, encoding="utf-8")
    with pytest.raises(AuthoredFileError) as error:
        load(MechanismFile, path)
    (found,) = error.value.findings
    assert (found.code, found.line, found.parameters["advice"]) == ("not_toml", line, remedy)
    assert set(found.parameters) == {"text", "advice"}
