"""Images that are no drawing of ours are refused before anything is read into them."""

from pathlib import Path

import pytest

from grader.pipeline import read_pages
from grader.records import PageRef
from grader.scan.page import open_page
from tests.bench import reading_scenes

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"
IMAGES = sorted(path for path in REAL.rglob("*") if path.suffix in {".jpg", ".png"}) if REAL.is_dir() else []


@pytest.mark.skipif(not IMAGES, reason="the real images are not here")
@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.name)
def test_a_foreign_image_is_refused_with_a_reason(path):
    seen = open_page(PageRef(path.name, path=path))
    assert seen.sheet is None
    assert seen.problems


@pytest.mark.slow
def test_a_page_of_text_is_read_as_nothing(tmp_path):
    path = reading_scenes._page(reading_scenes._text, seed=700).save(tmp_path / "text")
    page = open_page(PageRef(path.name, path=path))
    for name in reading_scenes.READ_AS:
        assignment, rubric = reading_scenes.task_named(name)
        reading = read_pages([page], assignment, assignment.variants()[0], {}, rubric.vectors)[0].reading
        sure = [one.confidence for figure in reading.figures.values() for one in figure.vectors.values()]
        assert max(sure, default=0.0) < 0.5
