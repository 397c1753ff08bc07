"""Lint: what an instructor is told about an assignment before a class draws it."""

from pathlib import Path

import numpy as np
import pytest

from grader.lint import LEAST_DRAWN_MM, lint
from grader.rubric import load_rubric
from reference.assignment import library, load_assignment
from reference.plan import exact_plan


def told(name: str | Path) -> list[str]:
    assignment = load_assignment(name)
    return [
        str(remark)
        for remark in lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))
    ]


@pytest.fixture
def edited(tmp_path: Path):
    def write(name: str, **changes: list[tuple[str, str]]) -> Path:
        for kind in ("assignment", "mechanism", "rubric"):
            text = (library() / f"{name}.{kind}.toml").read_text(encoding="utf-8")
            for old, new in changes.get(kind, []):
                assert old in text
                text = text.replace(old, new, 1)
            (tmp_path / f"{name}.{kind}.toml").write_text(text, encoding="utf-8")
        return tmp_path / f"{name}.assignment.toml"

    return write


def test_a_vector_too_short_is_told_with_its_worst_variant_first():
    pump = load_assignment("pump")
    plan = exact_plan(pump, pump.variants())
    drawn = np.abs(plan.drawn_mm("a_BA_n"))
    (line,) = [line for line in told("pump") if "a_BA_n" in line]
    assert line.startswith("rubric $.criterion[15].vector: ")
    assert f"n = {int(np.argmin(drawn)) + 1};" in line
    assert f"and {int(np.sum(drawn < LEAST_DRAWN_MM)) - 3} more" in line


def test_zero_vectors_at_dead_points_are_no_fault():
    assert not [line for line in told("press") if "position = 0" in line or "position = 4" in line]


def test_variants_that_do_not_assemble_are_told_with_the_group(edited):
    path = edited("pump", mechanism=[("lengths = [40, 30]", "lengths = [26, 30]")])
    (line,) = [line for line in told(path) if "does not assemble" in line]
    assert line.startswith(
        "mechanism $.group[0]: the group of B does not assemble: its links miss each other by"
    )
    assert line.endswith("n = 1; n = 2; n = 3 and 3 more")


def test_an_assignment_that_never_assembles_is_told_so_and_no_more(edited):
    lines = told(edited("pump", mechanism=[("lengths = [40, 30]", "lengths = [4, 3]")]))
    assert len(lines) == 1
    assert "and 27 more" in lines[0]


def test_a_mechanism_near_a_singular_position_is_told(edited):
    path = edited("engine", mechanism=[("length = 600", "length = 151")])
    lines = told(path)
    assert any(line.startswith("mechanism $.group[0]: B hangs on an angle") for line in lines)
    assert any("construction lines of b meet at only" in line for line in lines)


def test_a_name_that_the_mechanism_does_not_have_is_told(edited):
    path = edited("pump", rubric=[('vector = "v_D"', 'vector = "v_E"')])
    assert any(
        line.startswith("rubric $.criterion[9].vector: v_E is not in this mechanism") for line in told(path)
    )


def test_figures_too_large_for_their_sheet_are_told(edited):
    path = edited("pump", assignment=[("crank_mm = 60", "crank_mm = 300")])
    assert any(line.startswith("assignment $.scales: a figure does not fit") for line in told(path))
