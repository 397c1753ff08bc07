"""From a new assignment to its first plan, as a teacher would."""

import json
import re
import shlex
import tomllib
import xml.etree.ElementTree as ET

import pytest

from grader.documents import LintDocument


@pytest.mark.parametrize("options", [[], ["--mechanism", "shaper"], ["--like", "press"]])
def test_what_a_new_assignment_says_to_do_next_can_be_done(planmark, tmp_path, options):
    told = planmark("new", "mine.assignment.toml", *options)
    assert (told.returncode, told.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == {
        f"mine.{kind}.toml" for kind in ("assignment", "mechanism", "rubric")
    }
    following = re.findall(r"(?m)^(?:see it:|next:.*) (planmark .*)$", told.stdout)
    assert len(following) == 2
    for command in following:
        ran = planmark(*shlex.split(command)[1:])
        # The press has vectors that are too short, and lint says so.
        assert ran.returncode in ({0, 1} if "lint" in command and "press" in options else {0}), ran.stderr
    assert ET.parse(tmp_path / "plan.svg").getroot().tag.endswith("svg")


def test_lint_draws_the_variant_that_is_hardest_to_draw(planmark, tmp_path):
    ran = planmark("lint", "pump", "--svg", "worst.svg")
    assert ran.returncode == 1
    line = next(line for line in ran.stdout.splitlines() if line.startswith("hardest to draw: "))
    variant = line.split(": ")[1]
    drawn = "".join(ET.parse(tmp_path / "worst.svg").getroot().itertext())
    assert variant in drawn


def test_lints_findings_for_programs_have_the_same_exit_status(planmark):
    ran = planmark("lint", "pump", "--json")
    document = json.loads(ran.stdout)
    assert (ran.returncode, document["needs_a_person"]) == (1, True)
    planmark("new", "mine")
    ran = planmark("lint", "mine.assignment.toml", "--json")
    document = json.loads(ran.stdout)
    assert (ran.returncode, document["needs_a_person"]) == (0, False)
    assert {finding["severity"] for finding in document["findings"]} == {"hint"}


def test_lint_names_the_kind_of_a_file_that_is_no_assignment_with_the_faults_of_it(planmark, tmp_path):
    assert planmark("new", "mine").returncode == 0
    for kind, old in (("rubric", "points = 1.0"), ("mechanism", 'pin = "A"')):
        path = tmp_path / f"mine.{kind}.toml"
        path.write_text(path.read_text(encoding="utf-8").replace(old, f"{old}\nkey = 3", 1), encoding="utf-8")
        ran = planmark("lint", path.name)
        assert ran.returncode == 2
        assert re.search(rf"\$: is a {kind}: .*did you mean mine\.assignment\.toml\?", ran.stderr)
        assert len(re.findall(r"(?m)^  \$", ran.stderr)) == 2, ran.stderr
        assert "key: is not known here" in ran.stderr


def test_faults_of_files_are_json_too_where_json_is_asked_for(planmark, tmp_path):
    assert planmark("new", "mine").returncode == 0
    path = tmp_path / "mine.rubric.toml"
    path.write_text(path.read_text(encoding="utf-8") + "\n[tolerance]", encoding="utf-8")
    ran = planmark("lint", "mine.assignment.toml", "--json")
    (found,) = LintDocument.model_validate_json(ran.stdout).findings
    assert (ran.returncode, ran.stderr) == (2, "")
    assert (found.severity, found.file, found.code) == ("fault", "rubric", "not_toml")
    assert found.line == len(path.read_text(encoding="utf-8").splitlines())


def test_an_assignment_that_never_assembles_is_told_and_not_drawn(planmark, tmp_path):
    planmark("new", "mine")
    path = tmp_path / "mine.mechanism.toml"
    text = path.read_text(encoding="utf-8")
    assert "lengths = [40, 30]" in text
    path.write_text(text.replace("lengths = [40, 30]", "lengths = [4, 3]"), encoding="utf-8")
    assert tomllib.loads(path.read_text(encoding="utf-8"))["group"][0]["lengths"] == [4, 3]
    ran = planmark("lint", "mine.assignment.toml", "--svg", "worst.svg")
    assert ran.returncode == 1
    assert "nothing drawn" in ran.stdout
    assert not (tmp_path / "worst.svg").exists()
    assert "the group of B does not assemble" in ran.stdout


STEPHENSON_III = """
schema_version = 1
id = "stephenson"
title = { en = "Stephenson III", ro = "Stephenson III", ru = "Стефенсон III" }
length_unit = "cm"
ground = { O1 = [0, 0], O2 = [40, 0], O3 = [70, 15] }
crank = { pivot = "O1", pin = "A", length = 10, angle_deg = "12*n", rpm = 120 }
group = [
  { type = "RRR", node = "D", pins = ["C", "O3"], links = ["4", "5"], lengths = [42, 30], side = "left" },
  { type = "plate", node = "C", base = ["A", "B"], link = "2", lengths = [24, 20], side = "left" },
  { type = "RRR", node = "B", pins = ["A", "O2"], links = ["2", "3"], lengths = [35, 25], side = "left" },
]
"""
GROUP_OF_THE_THIRD_CLASS = """
group = [
  { type = "RRR", node = "C", pins = ["A", "B"], links = ["4", "2"], lengths = [42, 20], side = "left" },
  { type = "plate", node = "D", base = ["B", "C"], link = "2", lengths = [35, 24], side = "left" },
  { type = "RRR", node = "B", pins = ["O2", "D"], links = ["3", "2"], lengths = [25, 35], side = "left" },
  { type = "RRR", node = "D", pins = ["O1", "C"], links = ["5", "2"], lengths = [10, 24], side = "left" },
]
"""


def test_a_new_author_comes_from_a_six_bar_of_a_textbook_to_printed_sheets(planmark, tmp_path):
    """Groups in any order; then the crank at the third pivot, which leaves a triad."""
    path = tmp_path / "six.mechanism.toml"
    path.write_text(STEPHENSON_III, encoding="utf-8")
    told = planmark("new", "mine", "--mechanism", "six.mechanism.toml")
    assert (told.returncode, told.stderr) == (0, "")
    for command in re.findall(r"(?m)^(?:see it:|next:.*) (planmark .*)$", told.stdout):
        assert planmark(*shlex.split(command)[1:]).returncode == 0
    (tmp_path / "roster.csv").write_text("student_id,name,n\ns1,Ana,1\n", encoding="utf-8")
    assert planmark("sheet", "mine.assignment.toml", "--roster", "roster.csv", "-o", "s.pdf").returncode == 0
    third = (
        STEPHENSON_III.replace('pivot = "O1"', 'pivot = "O3"').partition("group")[0]
        + GROUP_OF_THE_THIRD_CLASS
    )
    path.write_text(third, encoding="utf-8")
    told = planmark("new", "other", "--mechanism", "six.mechanism.toml")
    assert told.returncode == 2
    assert (
        'AC, BCD, O2B, O1D form a triad, a group of class III: write one group of type = "triad"'
        in told.stderr
    )
    assert not (tmp_path / "other.assignment.toml").exists()


SIX_BAR_WITH_A_TRIAD = """
schema_version = 1
id = "six"
title = { en = "Six-bar with a triad" }
length_unit = "mm"
ground = { O1 = [0, 0], B = [143, -54], C = [146, 82] }
crank = { pivot = "O1", pin = "A", length = 25, angle_deg = "12*n", omega = 10 }

[[group]]
type = "triad"
nodes = ["D", "E", "F"]
pins = ["A", "B", "C"]
links = ["2", "3", "4", "5"]
lengths = [94, 87, 87, 54, 69, 65]
side = "left"
angle_deg = -110
assur_point = "S"
"""


def test_a_triad_is_drawn_by_its_assur_point_explained_and_printed(planmark, tmp_path):
    path = tmp_path / "six.mechanism.toml"
    path.write_text(SIX_BAR_WITH_A_TRIAD, encoding="utf-8")
    told = planmark("new", "mine", "--mechanism", "six.mechanism.toml")
    assert (told.returncode, told.stderr) == (0, "")
    assert "fault" not in planmark("lint", "mine.assignment.toml").stdout
    told = planmark("plan", "mine.assignment.toml", "--n", "3", "--svg", "plan.svg", "--steps", "steps.txt")
    assert told.returncode == 0
    steps = (tmp_path / "steps.txt").read_text(encoding="utf-8")
    assert "They meet in S." in steps
    assert "a̅_A    + a̅_DAⁿ      + a̅_SDⁿ      + a̅_SAᵗ" in steps
    plan = json.loads(planmark("plan", "mine.assignment.toml", "--n", "3", "--json").stdout)
    assert plan["conditioning"]["predicted_error"] < 1e-9
    told = planmark("cycle", "mine.assignment.toml", "--n", "3")
    assert "the crank turns fully" in told.stdout
    path.write_text(SIX_BAR_WITH_A_TRIAD.replace("-110", "0"), encoding="utf-8")
    (tmp_path / "mine.mechanism.toml").write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    told = planmark("lint", "mine.assignment.toml")
    assert "angle_deg of the triad of F tells no assembly clearly: there are" in told.stdout
    told = planmark("plan", "mine.assignment.toml", "--all")
    assert re.search(r"no variant can be solved; n = 1: .* clearly; there are -?\d", told.stderr)


EXCAVATOR = """
schema_version = 1
id = "excavator"
title = { en = "Excavator" }
length_unit = "mm"
ground = { O1 = [0, 0], O2 = [300, 200] }
[crank]
link = "2"
pivot = "O2"
pin = "B"
length = 250
cylinder = { pivot = "O1", length = "280 + 8*n", speed = 200, acceleration = 300, side = "right" }
[[group]]
type = "RPR"
node = "B1"
pin = "B"
pivot = "O1"
link = "1"
"""


def test_a_cylinder_of_driven_length_is_given_to_students_and_has_no_cycle(planmark, tmp_path):
    path = tmp_path / "arm.mechanism.toml"
    path.write_text(EXCAVATOR, encoding="utf-8")
    assert planmark("new", "mine", "--mechanism", "arm.mechanism.toml").returncode == 0
    given = tomllib.loads((tmp_path / "mine.assignment.toml").read_text(encoding="utf-8"))["given"]
    told = {datum["label"]: (datum["value"], datum["unit"]) for datum in given}
    assert (
        told.items()
        >= {"s(O1)": ("280 + 8*n", "mm"), "v(O1)": (200, "mm/s"), "a(O1)": (300, "mm/s²")}.items()
    )
    ran = planmark("plan", "mine.assignment.toml", "--n", "1", "--steps", "-")
    assert (ran.returncode, "ω₁ = " in ran.stdout) == (0, True), ran.stderr
    ran = planmark("cycle", "mine.assignment.toml", "--n", "1")
    assert (ran.returncode, ran.stdout) == (2, "")
    assert "known at the variant's position alone; use planmark plan --all" in ran.stderr
    path.write_text(EXCAVATOR.replace("280 + 8*n", "500 + 8*n"), encoding="utf-8")
    ran = planmark("new", "other", "--mechanism", "arm.mechanism.toml")
    assert ran.returncode == 2
    assert "$: '500 + 8*n' (cylinder) must lie between 0.110555 and 0.610555 m" in ran.stderr


@pytest.mark.parametrize(
    ("lang", "fault"),
    [
        ("ro", "lipsește: fără ea sunt posibile două asamblări"),
        ("ru", "отсутствует: без этого возможны две сборки"),
    ],
)
def test_faults_and_findings_are_told_in_the_language_of_the_call(planmark, tmp_path, lang, fault):
    assert planmark("new", "mine").returncode == 0
    found = json.loads(planmark("lint", "mine.assignment.toml", "--lang", lang, "--json").stdout)["findings"]
    english = json.loads(planmark("lint", "mine.assignment.toml", "--json").stdout)["findings"]
    assert [one["parameters"] for one in found] == [one["parameters"] for one in english]
    assert all(one["message"] != other["message"] for one, other in zip(found, english, strict=True))
    words = re.findall("[a-z]{4,}", planmark("lint", "mine.assignment.toml", "--lang", lang).stdout)
    assert not {"assembles", "variants", "shortest", "asked", "proposed", "hardest", "hint"}.intersection(
        words
    )
    path = tmp_path / "mine.mechanism.toml"
    path.write_text(re.sub(r"(?m)^side = .*$", "", path.read_text(encoding="utf-8")), encoding="utf-8")
    told = planmark("lint", "mine.assignment.toml", "--lang", lang)
    assert (told.returncode, "[0].side: " + fault in told.stderr) == (2, True), told.stderr
