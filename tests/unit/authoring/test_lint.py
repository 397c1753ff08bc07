import ast
import json
import re
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from grader.authoring.findings import named
from grader.authoring.lint import lint, lint_document
from grader.authoring.round_scales import asked_vectors
from grader.cli.exporting import schema
from grader.rubric import load_both, load_rubric
from reference.authored.assignment import Variant, built_in, library, load_assignment
from reference.errors import AuthoredFileError
from reference.plan import exact_plan
from tests.told import by_path, tells

ROOT = Path(__file__).resolve().parents[3]
SINE_TOLERANCE = 1e-9


def edited(tmp_path: Path, name: str, kind: str, old: str, new: str) -> Path:
    """A built-in assignment's own files copied, with one text replaced in one of them."""
    for each in ("assignment", "mechanism", "rubric"):
        if not (library() / f"{name}.{each}.toml").is_file():
            continue
        text = (library() / f"{name}.{each}.toml").read_text(encoding="utf-8")
        if each == kind:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / f"{name}.{each}.toml").write_text(text, encoding="utf-8")
    return tmp_path / f"{name}.assignment.toml"


def linted(path: Path | str):
    assignment = load_assignment(path)
    return lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))


def test_faults_behind_unknown_keys_are_told_with_them_in_all_three_files(tmp_path):
    path = edited(tmp_path, "pump", "assignment", 'mechanism = "pump"', 'mechanism = "pump"\nnote = 1')
    for name, old, new in (
        ("mechanism", 'pin = "A"', 'pn = "A"'),
        ("rubric", 'vector = "v_A"', 'vector = "v_Z"\nkey = 1'),
    ):
        file = tmp_path / f"pump.{name}.toml"
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new, 1), encoding="utf-8")

    def told() -> dict[str, list[str]]:
        with pytest.raises(AuthoredFileError) as error:
            load_both(path)
        files = (error.value, *error.value.others)
        return {Path(one.file).name.split(".")[1]: [*by_path(one.findings)] for one in files}

    index = next(k for k, one in enumerate(load_rubric("pump").criterion) if one.vector == "v_A")
    asked = f"$.criterion[{index}]"
    assert told() == {
        "assignment": ["$.note"],
        "mechanism": ["$.crank.pin", "$.crank.pn"],
        "rubric": [f"{asked}.key", f"{asked}.vector"],
    }
    path.write_text(path.read_text(encoding="utf-8").replace("omega * kL", "omega * zeta"), encoding="utf-8")
    assert told()["assignment"] == ["$.note", "$.scales.kv"]


def findings_of(path: Path | str, code: str):
    return [one for one in linted(path).findings if one.code == code]


def test_vectors_too_short_to_measure_are_told_with_their_variants():
    told = [one for one in findings_of("pump", "short_vector") if "a_DC_n" in one.message()]
    assert len(told) == 1
    # Short in 7 of 30 variants, and measured in the others.
    assert (told[0].severity, told[0].file) == ("hint", "rubric")
    rubric = tomllib.loads((library() / "pump.rubric.toml").read_text(encoding="utf-8"))
    index = int(told[0].path.removeprefix("$.criterion[").removesuffix("]"))
    assert rubric["criterion"][index]["vector"] == "a_DC_n"
    pump = load_assignment("pump")
    lengths = np.abs(exact_plan(pump, pump.variants()).drawn_mm("a_DC_n"))
    assert [variant.n for variant in told[0].variants] == [n for n, mm in enumerate(lengths, 1) if mm < 3.0]


def test_a_vector_of_true_length_zero_is_a_hint_and_no_scale_is_blamed():
    found = linted("press")
    zero = {one.message().split()[0]: one for one in found.findings if one.code == "zero_vector"}
    assert {"v_B", "v_C", "v_D", "v_DC", "a_B_n"} <= set(zero)
    assert [variant.position for variant in zero["v_B"].variants] == [0, 4]
    assert not any(one.code == "short_vector" and "v_B is" in one.message() for one in found.findings)
    assert found.rows[0].shortest_mm.value > 3.0


def test_a_figure_larger_than_its_zone_is_told_and_would_fit_at_the_size_told(tmp_path):
    told = [one for one in findings_of("press", "does_not_fit") if "mechanism" in one.message()]
    assert {one.path for one in told} == {"$.page[0]", "$.page[1]"}
    rooms = [row.room for row in linted("press").rows]
    assert all(one.at.endswith(f" on page {one.page}") for one in rooms)
    assert not findings_of("engine", "does_not_fit")
    # Drawn with a crank of 45 * 0.31 mm the sketch of page 1 fits.
    smaller = edited(tmp_path, "press", "assignment", "crank_mm = 45", "crank_mm = 13.5")
    assert not [one for one in findings_of(smaller, "does_not_fit") if "mechanism" in one.message()]


def test_variants_that_do_not_assemble_are_one_fault_and_the_others_still_looked_at(tmp_path):
    path = edited(tmp_path, "pump", "assignment", "from = 1, to = 30", "from = 1, to = 80")
    found = linted(path)
    faults = [one for one in found.findings if one.severity == "fault"]
    assert [one.code for one in faults] == ["does_not_assemble"]
    assert (faults[0].file, faults[0].path) == ("mechanism", "$.group[0]")
    broken = [row.n for row in found.rows if row.problem]
    assert [variant.n for variant in faults[0].variants] == broken
    assert 75 in broken
    assert len(found.rows) == 80
    assert len(found.plan.variants) == 80 - len(broken)
    assert any(one.code == "short_vector" for one in found.findings)


def test_how_far_links_miss_each_other_is_told_as_a_range(tmp_path):
    path = edited(tmp_path, "pump", "mechanism", "lengths = [40, 30]", "lengths = [4, 3]")
    found = linted(path)
    assert found.plan is None
    (fault,) = [one for one in found.findings if one.code == "does_not_assemble"]
    # O2A of n is 60 cos((30 + 2n)/2 deg) cm; the links reach 7 cm.
    gaps = [0.6 * np.cos(np.radians(15 + n)) - 0.07 for n in (1, 30)]
    told = (
        f"the group of B does not assemble: its links miss each other by {gaps[1]:.3g} m .. {gaps[0]:.3g} m;"
    )
    assert fault.message().startswith(told)
    assert lint_document(found).variants[0].assembles is False


def test_a_rubric_that_asks_for_what_is_not_there_is_a_fault(tmp_path):
    path = edited(tmp_path, "engine", "rubric", 'vector = "v_D"', 'vector = "v_E"')
    (fault,) = findings_of(path, "unknown_in_rubric")
    assert "no drawing of this assignment has v_E" in fault.message()
    assert fault.severity == "fault"


def test_a_singular_position_is_told_with_the_group_that_it_hangs_on(tmp_path):
    # The rod as long as the guide is far: near its limit the slider is at its dead point.
    path = edited(tmp_path, "engine", "mechanism", "through = [0, 0]", "through = [0, 449]")
    found = linted(path)
    (told,) = [one for one in found.findings if one.code == "transmission"]
    assert told.path == "$.group[0]"
    least = min(row.transmission.value for row in found.rows if row.transmission)
    (crossing,) = [one for one in found.findings if one.code == "crossing"]
    assert "b, b'" in crossing.message()
    # Of a slider both are one angle: between the rod's perpendicular and the guide.
    worst = min(row.crossing_deg.value for row in found.rows if row.crossing_deg)
    assert np.sin(np.radians(worst)) == pytest.approx(least, abs=SINE_TOLERANCE)
    hardest = min((row for row in found.rows if row.transmission), key=lambda row: row.transmission.value)
    assert found.worst[0] == Variant(hardest.n, hardest.position)


def test_the_same_drawing_for_two_students_is_a_tie(tmp_path):
    path = edited(tmp_path, "engine", "assignment", '"15*n - 5"', '"30*n - 5"')
    (tie,) = findings_of(path, "ties")
    assert tie.severity == "warning"
    assert "n = 1, 13" in tie.message()
    assert len(tie.variants) == 24
    assert not findings_of("engine", "ties")


def test_variants_that_could_be_copied_are_counted(tmp_path):
    path = edited(tmp_path, "engine", "assignment", '"15*n - 5"', '"40 + 0.3*n"')
    (near,) = findings_of(path, "near_ties")
    assert near.severity == "hint"
    assert "n = 1 for n = 2" in near.message() or "n = 1 for n = 3" in near.message()


def test_a_mechanism_that_does_not_depend_on_n_is_told(tmp_path):
    path = edited(tmp_path, "engine", "mechanism", '"phi_deg"', "40")
    text = path.read_text(encoding="utf-8").replace('"280 + 20*n"', "300")
    path.write_text(text, encoding="utf-8")
    (told,) = findings_of(path, "same_for_all")
    assert told.path == "$.variant.n"
    (tie,) = findings_of(path, "ties")
    assert len(tie.variants) == 24


def test_data_that_nothing_uses_are_told(tmp_path):
    path = edited(tmp_path, "engine", "assignment", 'phi_deg = "', 'psi_deg = "3*n"\nphi_deg = "')
    text = path.read_text(encoding="utf-8") + '\n[names]\n"o" = "p"\n"q" = "Q"\n'
    path.write_text(text, encoding="utf-8")
    told = {one.path for one in findings_of(path, "unused")}
    assert told == {"$.variant.values.psi_deg", '$.names."q"'}


def test_a_joint_that_the_rubric_does_not_need_is_told(tmp_path):
    path = edited(tmp_path, "engine", "rubric", 'vector = "v_D"', 'vector = "v_B"')
    text = (tmp_path / "engine.rubric.toml").read_text(encoding="utf-8").replace('"a_D"', '"a_BA_t"')
    (tmp_path / "engine.rubric.toml").write_text(
        text.replace('id = "a_BA_t"', 'id = "x"', 1), encoding="utf-8"
    )
    assert "$.group[1]" in {one.path for one in findings_of(path, "unused")}
    assert findings_of(path, "asked_twice")


def test_a_datum_that_no_student_is_told_is_a_hint(tmp_path):
    path = edited(tmp_path, "engine", "assignment", 'value = "phi_deg"', "value = 1")
    (told,) = findings_of(path, "not_told")
    assert told.message().endswith("phi_deg")
    assert not findings_of("engine", "not_told")
    assert not findings_of("press", "not_told")


def test_a_rubric_whose_accelerations_have_no_page_is_told(tmp_path):
    path = edited(tmp_path, "engine", "assignment", ', "acceleration_plan"]', "]")
    (told,) = findings_of(path, "no_page")
    assert "acceleration plan" in told.message()


def test_own_accelerations_without_an_acceleration_plan_are_a_fault(tmp_path):
    path = edited(tmp_path, "pump-forces", "rubric", 'accelerations = "given"', 'accelerations = "own"')
    (told,) = findings_of(path, "unknown_in_rubric")
    assert (told.path, told.severity) == ("$.accelerations", "fault")
    assert 'add one, or say "given"' in told.message()


def test_force_plans_share_a_sheet_with_the_mechanism_only(tmp_path):
    path = edited(
        tmp_path, "pump-forces", "assignment", '"force_plan_D",', '"force_plan_D", "velocity_plan",'
    )
    with pytest.raises(AuthoredFileError, check=tells("put the velocity plan on another page")) as caught:
        load_assignment(path)
    assert [finding.path for finding in caught.value.findings] == ["$.page[0].figures"]


def test_a_force_plan_without_a_page_is_told_just_where_it_is_asked_for(tmp_path):
    assert not findings_of("pump-forces", "no_page")
    path = edited(tmp_path, "pump-forces", "rubric", '\nvector = "R_43"', '\nvector = "R_31"')
    (told,) = findings_of(path, "no_page")
    assert "group of A" in told.message()


@pytest.mark.parametrize("name", ["pump-forces", "press-forces"])
def test_built_in_force_plans_fit_and_are_long_enough_to_measure(name):
    found = linted(name)
    assert not found.needs_a_person
    asked = asked_vectors(load_rubric(name), found.plan)
    assert np.mean(asked.length_mm < 5.0) < 0.06


def test_a_rubric_of_velocities_asks_for_no_accelerations():
    pump = load_assignment("pump")
    found = lint(pump, load_rubric("pump-velocity"))
    assert any(one.code == "unused" and "acceleration plan" in one.message() for one in found.findings)
    assert not any("a_" in one.message().split()[0] for one in found.findings if one.code == "short_vector")


def test_the_altitude_method_is_refused_just_where_the_scales_do_not_allow_it():
    assert findings_of("press", "no_altitude_method")
    assert not findings_of("pump", "no_altitude_method")


@pytest.mark.parametrize("name", built_in())
def test_what_lint_finds_as_json_is_what_its_schema_says(name):
    found = linted(name)
    document = json.loads(lint_document(found).model_dump_json())
    jsonschema.validate(document, schema("lint"))
    assert document["needs_a_person"] == any(one["severity"] != "hint" for one in document["findings"])
    assert len(document["variants"]) == len(load_assignment(name).variants())


def codes() -> set[str]:
    """Every code that the source gives to a finding."""
    trees = (
        ast.parse(source.read_text(encoding="utf-8")) for source in (ROOT / "grader/authoring").glob("*.py")
    )
    calls = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Call))
    made = (call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "LintFinding")
    return {call.args[1].value for call in made if isinstance(call.args[1], ast.Constant)}


def test_every_code_of_a_finding_is_documented():
    found = codes()
    assert len(found) > 15
    documented = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    assert not {code for code in found if f"`{code}`" not in documented}


@pytest.mark.parametrize(
    ("variants", "told"),
    [
        ([Variant(1), Variant(2), Variant(3), Variant(7)], "n = 1..3, 7"),
        ([Variant(None, 0), Variant(None, 4)], "position = 0, 4"),
        ([Variant(3, 0), Variant(3, 1), Variant(4, 2)], "n = 3, position = 0, 1; n = 4, position = 2"),
        ([Variant(n, p) for n in (1, 2, 3) for p in (0, 4)], "n = 1..3, position = 0, 4"),
        ([Variant(n) for n in range(1, 40, 2)], "n = 1, 3, 5, 7, 9, 11, ... (+14)"),
        ([Variant()], "the only variant"),
    ],
)
def test_variants_are_named_shortly(variants, told):
    assert named(variants) == told


def within(tmp_path: Path, start: str, old: str, new: str, criterion: str) -> Path:
    """A start with its mechanism within its assignment, one text of it replaced, and a rubric."""
    text, mechanism = (
        (library() / "starts" / f"{start}.{kind}.toml").read_text(encoding="utf-8")
        for kind in ("assignment", "mechanism")
    )
    assert old in mechanism
    tables = re.sub(r"(?m)^(\[\[?)", r"\1mechanism.", mechanism.replace(old, new))
    text = re.sub(r"(?m)^mechanism = .*\n", "", text) + f"\n[mechanism]\n{tables}"
    (tmp_path / f"{start}.assignment.toml").write_text(text, encoding="utf-8")
    rubric = f'schema_version = 1\nid = "{start}"\ntitle = {{ en = "R" }}\n[[criterion]]\n{criterion}\n'
    (tmp_path / f"{start}.rubric.toml").write_text(
        rubric + 'id = "x"\ntitle = { en = "X" }\npoints = 1\n', "utf-8"
    )
    return tmp_path / f"{start}.assignment.toml"


def test_a_mechanism_within_its_assignment_has_its_paths_there(tmp_path):
    path = within(tmp_path, "four-bar", "lengths = [40, 30]", "lengths = [10, 30]", 'vector = "v_B"')
    (fault,) = findings_of(path, "does_not_assemble")
    assert (fault.file, fault.path) == ("assignment", "$.mechanism.group[0]")


def test_a_rubric_of_scales_alone_is_told_to_ask_for_no_vector(tmp_path):
    path = within(tmp_path, "scotch-yoke", "slot_deg = 75", "slot_deg = 80", 'scale = "kL"')
    assert findings_of(path, "no_vector_asked")
    found = linted(path)
    assert all(row.shortest_mm is None for row in found.rows)
    assert not found.needs_a_person


def test_a_plan_that_needed_more_digits_is_told(tmp_path):
    # Rod as long as the crank, both square to the guide but for a ten millionth of a degree.
    flat = 'angle_deg = "phi_deg + 0.0000001"'
    path = within(tmp_path, "slider-crank", 'angle_deg = "phi_deg"', flat, 'vector = "v_B"')
    text = path.read_text(encoding="utf-8").replace('"15 + n"', '"90"').replace("length = 30", "length = 10")
    path.write_text(text, encoding="utf-8")
    (told,) = findings_of(path, "recomputed")
    assert told.severity == "hint"
    assert len(told.variants) == 30
    assert findings_of(path, "transmission")


def test_a_singular_variant_among_sound_ones_is_left_out_and_told(tmp_path):
    path = within(tmp_path, "slider-crank", "length = 30", "length = 10", 'vector = "v_B"')
    path.write_text(path.read_text(encoding="utf-8").replace('"15 + n"', '"80 + n"'), encoding="utf-8")
    found = linted(path)
    (fault,) = [one for one in found.findings if one.severity == "fault"]
    assert fault.code == "singular"
    assert "group of B" in fault.message()
    assert [variant.n for variant in fault.variants] == [10]
    assert len(found.plan.variants) == 29


@pytest.mark.parametrize(("side", "told"), [("left", "n = 16..30"), ("15.5 - n", None)])
def test_variants_behind_a_flat_position_are_told(tmp_path, side, told):
    starts = library() / "starts"
    for kind, old, new in (
        ("assignment", "220 + 2*n", "12*n - 6"),
        ("mechanism", "lengths = [40, 30]", "lengths = [50, 20]"),
        ("mechanism", 'side = "left"', f'side = "{side}"'),
        ("rubric", "", ""),
    ):
        path = tmp_path / f"four-bar.{kind}.toml"
        text = (path if path.exists() else starts / path.name).read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new) if old else text, encoding="utf-8")
    found = findings_of(tmp_path / "four-bar.assignment.toml", "another_assembly")
    assert [named(one.variants) for one in found] == ([told] if told else [])
    assert {one.path for one in found} <= {"$.group[0].side"}


@pytest.mark.parametrize(
    ("kind", "old", "path"),
    [
        ("rubric", 'ro = "Viteza punctului A", ', "$.criterion["),
        ("mechanism", "ro = ", "$.title"),
        ("assignment", "ro = ", "$."),
    ],
)
def test_a_text_that_is_missing_in_one_language_is_told_with_its_path(tmp_path, kind, old, path):
    file = edited(tmp_path, "shaper", kind, old, "" if old.startswith('ro = "') else "# ro = ")
    told = findings_of(file, "not_translated")
    assert [(one.severity, one.file) for one in told] == [("hint", kind)]
    assert told[0].path.startswith(path)
    assert told[0].path.endswith(".ro")
    assert told[0].path in told[0].message()


@pytest.mark.parametrize("name", built_in())
def test_the_built_in_assignments_are_in_three_languages(name):
    assert not findings_of(name, "not_translated")


def test_given_data_that_are_asked_for_are_told(tmp_path):
    given = 'label = "n"\nvalue = 1350\nunit = "rev/min"'
    told_omega = 'label = "ω1"\nvalue = 6.016\nunit = "rad/s"'
    (told,) = findings_of(edited(tmp_path, "press", "assignment", given, told_omega), "result_told")
    assert (told.severity, told.path) == ("warning", "$.given[1]")
    assert told.message().startswith("omega_1")
    assert not [name for name in built_in() if findings_of(name, "result_told")]
