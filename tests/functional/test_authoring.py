"""From a new assignment to its first plan, as a teacher would."""

import json
import re
import shlex
import tomllib
import xml.etree.ElementTree as ET

import pytest


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
