"""Without simplejpeg, of which the newest Pythons have no wheel, Pillow reads the same pixels."""

import io

import numpy as np
import pytest
from PIL import Image

from grader.scan.decode import jpeg
from grader.scan.decode.pages import page_of
from tests.unit.scan.decode.test_intake import refused

pytest.importorskip("simplejpeg")
SHADES = np.add.outer(np.arange(300), np.arange(420)) % 256
COLOURS = np.stack([SHADES, SHADES[::-1], 255 - SHADES], axis=2).astype(np.uint8)


def stream(mode="RGB", **how):
    buffer = io.BytesIO()
    Image.fromarray(COLOURS).convert(mode).save(buffer, "JPEG", quality=80, **how)
    return buffer.getvalue()


@pytest.fixture
def without(monkeypatch):
    return lambda: monkeypatch.setattr(jpeg, "simplejpeg", None)


@pytest.mark.parametrize(
    "how", [{"mode": "L"}, {"subsampling": 0}, {"subsampling": 2}, {"progressive": True}]
)
def test_header_and_pixels_are_the_same(how, without):
    data = stream(**how)
    header, pixels = jpeg.header(data), jpeg.pixels(data, strict=True)
    without()
    assert jpeg.header(data)[:3] == header[:3]
    assert np.array_equal(jpeg.pixels(data, strict=True), pixels)


def test_four_inks_are_known(without):
    data = stream("CMYK")
    assert jpeg.header(data)[2] in {"CMYK", "YCCK"}
    without()
    assert jpeg.header(data)[2] == "CMYK"


@pytest.mark.parametrize("content", [b"", b"\xff\xd8\xff", b"no picture"])
def test_what_is_no_jpeg_is_refused(content, without):
    without()
    with pytest.raises(ValueError, match="no JPEG"):
        jpeg.header(content)


def test_a_file_that_is_cut_off_is_told(tmp_path, without):
    without()
    path = tmp_path / "cut.jpg"
    large = Image.fromarray(np.repeat(np.repeat(COLOURS, 5, axis=0), 5, axis=1))
    large.save(path, "JPEG")
    path.write_bytes(path.read_bytes()[:-20_000])
    assert refused(lambda: page_of(path, 1)).code == "image_truncated"
