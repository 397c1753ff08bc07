"""Pictures in every colour space that PDF allows: as a viewer shows them, or refused with a reason."""

import zlib

import cv2
import numpy as np
import pytest
from pikepdf import Array, Dictionary, Name, String
from PIL import ImageCms

from grader.pipeline import open_page
from grader.records import PageRef
from tests.hostile import paper
from tests.unit.scan.decode.test_intake import SHAPE, only_page, raw_pdf, refused

GREY = paper()
DARK = 255 - GREY
NOTHING = np.zeros_like(GREY)
WHITE = [0.95, 1.0, 1.09]
NEAR = 40
"""Grey values out of 255: the renderer shows full black ink as 32, and smooths a border."""


def ink(white, black):
    """The colours of one ink from none of it to all."""
    return Dictionary(FunctionType=2, Domain=[0, 1], C0=white, C1=black, N=1)


def separation(base=Name.DeviceGray, white=(1,), black=(0,)):
    return lambda _: Array([Name.Separation, Name.Black, base, ink(list(white), list(black))])


def inks(program):
    def space(pdf):
        function = pdf.make_stream(program, Dictionary(FunctionType=4, Domain=[0, 1, 0, 1], Range=[0, 1] * 4))
        return Array([Name.DeviceN, Array([Name.Cyan, Name.Black]), Name.DeviceCMYK, function])

    return space


def profile(channels, data=b"no profile"):
    def space(pdf):
        stream = pdf.make_stream(data)
        stream.N = channels
        return Array([Name.ICCBased, stream])

    return space


SRGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
PALETTE = String(bytes(np.repeat(np.arange(256, dtype=np.uint8), 3)))
FOUR = (Name.DeviceCMYK, (0, 0, 0, 0), (0, 0, 0, 1))
SPACES = {
    "grey": (Name.DeviceGray, GREY),
    "colour": (Name.DeviceRGB, np.dstack([GREY] * 3)),
    "four inks": (Name.DeviceCMYK, np.dstack([NOTHING] * 3 + [DARK])),
    "calibrated grey": (Array([Name.CalGray, Dictionary(WhitePoint=WHITE)]), GREY),
    "calibrated colour": (Array([Name.CalRGB, Dictionary(WhitePoint=WHITE)]), np.dstack([GREY] * 3)),
    "Lab": (Array([Name.Lab, Dictionary(WhitePoint=WHITE)]), np.dstack([GREY, NOTHING + 128, NOTHING + 128])),
    "profile of three": (profile(3, SRGB), np.dstack([GREY] * 3)),
    "profile of four": (profile(4), np.dstack([NOTHING] * 3 + [DARK])),
    "palette": (Array([Name.Indexed, Name.DeviceRGB, 255, PALETTE]), GREY),
    "palette of an ink": (
        lambda pdf: Array([Name.Indexed, separation()(pdf), 255, String(bytes(range(256)))]), DARK
    ),
    "black ink": (separation(), DARK),
    "black ink by four": (separation(*FOUR), DARK),
    "two inks": (inks(b"{ 0 0 3 -1 roll }"), np.dstack([NOTHING, DARK])),
    "sixteen bits": (Name.DeviceGray, GREY.astype(">u2") * 257),
}  # fmt: skip


def pdf_in(path, space, pixels, **entries):
    """A PDF of one picture in a colour space, which may need the file to be made in."""
    entries.setdefault("BitsPerComponent", 8 * pixels.itemsize)
    pdf, page = raw_pdf(zlib.compress(pixels.tobytes()), **entries)
    if space is not None:
        page.Resources.XObject.Scan.ColorSpace = space(pdf) if callable(space) else space
    pdf.save(path)
    return path


def shown(path):
    """The page's grey at the size of what was stored."""
    return cv2.resize(only_page(path).grey, SHAPE[::-1], interpolation=cv2.INTER_AREA)


@pytest.mark.parametrize("name", SPACES)
def test_a_picture_is_as_dark_as_a_viewer_shows_it(tmp_path, name):
    seen = shown(pdf_in(tmp_path / "scan.pdf", *SPACES[name]))
    assert np.quantile(np.abs(seen.astype(int) - GREY), 0.98) < NEAR
    assert seen[GREY == 250].mean() > 240
    assert seen[GREY == 20].mean() < 80


def test_a_mask_and_an_inverted_picture_are_dark_where_a_viewer_shows_ink(tmp_path):
    inverted = pdf_in(tmp_path / "inverted.pdf", Name.DeviceGray, DARK, Decode=[1, 0])
    assert shown(inverted)[GREY == 20].mean() < 80
    for decode, stored in (([0, 1], GREY > 128), ([1, 0], GREY < 128)):
        entries = {"ImageMask": True, "BitsPerComponent": 1, "Decode": decode}
        mask = shown(pdf_in(tmp_path / "mask.pdf", None, np.packbits(stored, axis=1), **entries))
        assert mask[GREY == 20].mean() < 80
        assert mask[GREY == 250].mean() > 240


def test_a_picture_whose_colours_nobody_knows_is_refused(tmp_path):
    path = pdf_in(tmp_path / "scan.pdf", Name("/Other"), GREY)
    assert refused(lambda: only_page(path)).code == "image_damaged"


def test_a_picture_in_inks_that_cannot_be_carried_out_is_no_drawing(tmp_path):
    path = pdf_in(tmp_path / "scan.pdf", inks(b"{ foo }"), np.dstack([NOTHING, DARK]))
    (problem,) = open_page(PageRef("scan.pdf", path=path)).problems
    assert problem.code == "sheet_refused"
