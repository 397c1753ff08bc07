from pathlib import Path

from grader.lint import lint
from grader.rubric import load_rubric
from reference.assignment import library, load_assignment


def edited(tmp_path: Path, name: str, kind: str, old: str, new: str) -> Path:
    """A built-in assignment's files copied, with one text replaced in one of them."""
    for each in ("assignment", "mechanism", "rubric"):
        text = (library() / f"{name}.{each}.toml").read_text(encoding="utf-8")
        if each == kind:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / f"{name}.{each}.toml").write_text(text, encoding="utf-8")
    return tmp_path / f"{name}.assignment.toml"


def findings_of(path: Path | str) -> list[str]:
    assignment = load_assignment(path)
    return [str(one) for one in lint(assignment, load_rubric(assignment.file.rubric, beside=assignment.path))]


def test_vectors_too_short_to_measure_are_told_with_their_variants():
    told = [one for one in findings_of("pump") if "a_DC_n is shorter" in one]
    assert len(told) == 1
    assert told[0].startswith("rubric $.criterion[")
    assert "n = " in told[0]


def test_a_figure_larger_than_its_zone_is_told():
    assert any("mechanism does not fit" in one for one in findings_of("press"))
    assert not any("does not fit" in one for one in findings_of("engine"))


def test_variants_that_do_not_assemble_are_named_and_the_others_still_looked_at(tmp_path):
    path = edited(tmp_path, "pump", "assignment", "from = 1, to = 30", "from = 1, to = 80")
    told = findings_of(path)
    assert any("n = 75" in one and "does not assemble" in one for one in told)
    assert any("a_DC_n is shorter" in one for one in told)


def test_a_rubric_that_asks_for_what_is_not_there_is_told(tmp_path):
    told = findings_of(edited(tmp_path, "engine", "rubric", 'vector = "v_D"', 'vector = "v_E"'))
    assert any("v_E is not in this mechanism" in one for one in told)


def test_a_singular_position_is_told(tmp_path):
    # The rod as long as the guide is far: near its limit the slider is at its dead point.
    path = edited(tmp_path, "engine", "mechanism", "through = [0, 0]", "through = [0, 449]")
    assert any("near a singular position" in one for one in findings_of(path))
