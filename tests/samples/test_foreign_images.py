"""Images that are no drawing of ours are refused before anything is read into them."""

from pathlib import Path

import pytest

from grader.pipeline import Place, see

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"
IMAGES = sorted(path for path in REAL.rglob("*") if path.suffix in {".jpg", ".png"}) if REAL.is_dir() else []


@pytest.mark.skipif(not IMAGES, reason="the real images are not here")
@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.name)
def test_a_foreign_image_is_refused_with_a_reason(path):
    seen = see(Place(path, 1, path.name))
    assert seen.sheet is None
    assert seen.problems
