"""A student's own check of a photo: what is right and off, what was not read, what spoils the picture."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.self_check.photo import photo_check
from grader.self_check.values import SelfCheck
from tests.bench.reading_scenes import ReadingScene, SceneWork, work
from tests.functional.conftest import Run

PHOTO = ReadingScene("photo", "", device="phone", dpi=None, printed=True, hardship=0.0)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[SceneWork, Path]:
    """A student's velocities on a printed sheet, photographed."""
    student = work(PHOTO, 1, most=1)
    return student, student.sheets[0].save(tmp_path_factory.mktemp("photo") / "sheet")


def checked(student: SceneWork, path: Path, lang: str = "en") -> SelfCheck:
    return photo_check(path, student.assignment, student.rubric, student.variant, lang, "hint")


def test_what_is_drawn_rightly_is_right_and_nothing_expected_is_shown(drawn: tuple[SceneWork, Path]) -> None:
    student, path = drawn
    told = checked(student, path)
    assert not told.flaws
    vectors = {line.name: line for line in told.lines if line.name.startswith("v_")}
    assert len(vectors) >= 6
    assert {line.result for line in vectors.values()} <= {"right", "open"}
    assert sum(line.result == "right" for line in vectors.values()) >= len(vectors) - 1
    assert all(line.checked.expected is None for line in told.lines)
    (picture,) = told.pictures
    assert not picture.scene.ghosts
    assert any("acceleration plan" in problem for problem in told.problems)


@pytest.mark.slow
def test_another_variant_is_off_without_the_answer(drawn: tuple[SceneWork, Path]) -> None:
    student, path = drawn
    others = [one for one in student.assignment.variants() if one != student.variant]
    told = checked(replace(student, variant=others[-1]), path, "ro")
    assert not told.is_all_right
    assert any("n" in problem for problem in told.problems)


def test_a_cut_photo_that_is_not_read_says_which_corners(
    drawn: tuple[SceneWork, Path], tmp_path: Path
) -> None:
    student, path = drawn
    picture = cv2.imread(str(path))
    cut = tmp_path / "cut.jpg"
    cv2.imwrite(str(cut), np.ascontiguousarray(picture[: round(0.75 * picture.shape[0])]))
    told = checked(student, cut, "ru")
    assert "угол" in told.flaws["corner_cut"]
    assert not told.is_all_right


def test_a_file_that_is_no_picture_is_told(drawn: tuple[SceneWork, Path], tmp_path: Path) -> None:
    student, _ = drawn
    file = tmp_path / "sheet.jpg"
    file.write_bytes(b"no picture")
    told = checked(student, file)
    assert told.problems
    assert told.judgement is None
    assert not told.flaws


def test_the_command_line_tells_flaws_first_and_refuses_what_does_not_go_together(
    drawn: tuple[SceneWork, Path], tmp_path: Path, planmark: Run
) -> None:
    student, path = drawn
    small = tmp_path / "small.jpg"
    picture = cv2.imread(str(path))
    cv2.imwrite(str(small), cv2.resize(picture, None, fx=0.35, fy=0.35, interpolation=cv2.INTER_AREA))
    call = ["check", "pump", "--n", str(student.variant.n), "--photo", str(small)]
    told = planmark(*call)
    assert told.returncode == 1
    assert "too few pixels" in " ".join(told.stdout.split())
    refused = planmark(*call, "--measured", "mine.csv")
    assert refused.returncode == 2
