"""The simulation does not share the grader's model of a hand and of mistakes.

The content of a drawing is data of the exact plan (steps, vectors, lengths). The simulation has its own model
of drafting and of mistakes, so that benchmarks measure the grader against another model than the grader's.
"""

import ast
from pathlib import Path

import pytest

import samples.simulation

FOLDER = Path(samples.simulation.__file__).parent
OF_THE_GRADER = {"layout"}
"""The layout of a printed answer sheet is the paper drawn on."""
NOT_OF_THE_REFERENCE = {"following", "hand", "mistakes", "replay", "uncertainty"}
"""Models of drafting errors, of mistakes, and the search for what was done."""


def imports_of(path):
    """Every module and name that a file imports, dotted."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{name.name}" for name in node.names)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_no_module_of_the_simulation_imports_the_graders_model(path):
    for name in imports_of(path):
        room, *parts = name.split(".")
        if room == "grader":
            assert OF_THE_GRADER & set(parts), name
        if room == "reference":
            assert not NOT_OF_THE_REFERENCE & set(parts), name


def test_the_forbidden_modules_are_recognised(tmp_path):
    file = tmp_path / "student.py"
    text = "from reference.construction.uncertainty import Skill\nimport grader.rubric\n"
    file.write_text(text, encoding="utf-8")
    assert list(imports_of(file)) == ["reference.construction.uncertainty.Skill", "grader.rubric"]
