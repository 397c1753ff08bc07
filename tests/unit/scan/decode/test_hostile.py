"""Files that are made to harm are refused before they do; what a page lacks is that page's problem."""

import io
import os
import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

import cv2
import numpy as np
import pikepdf
import pytest
import tifffile
from PIL import Image

from grader.folder.cache import PageCache
from grader.folder.inventory import take_inventory
from grader.records import Page, PageRef
from grader.scan.decode import limits, pictures
from grader.scan.decode.fax import Coding, damaged_row
from grader.scan.decode.limits import MAX_FILE_BYTES, InputFile, load
from grader.scan.decode.pages import count_pages, is_blank, page_of, pages_of
from grader.scan.page import open_page
from grader.scan.register.registration import register
from reference.errors import InputFileError
from tests import hostile
from tests.inline import Inline
from tests.unit.scan.decode.test_intake import refused
from tests.waiting import PATIENCE_S

PROJECT = Path(__file__).parents[4]
WORKER_BYTES = 1_500_000_000


def handed_in(data, name="scan"):
    return InputFile(name, data, "")


def code_of(data):
    return refused(lambda: list(pages_of(handed_in(data)))).code


REFUSED = {
    hostile.thin_picture: "image_too_small",
    hostile.tiny_picture: "image_too_small",
    hostile.png_of_many_pixels: "image_too_large",
    hostile.png_of_deep_pixels: "image_too_large",
    hostile.jpeg_of_many_scans: "image_too_large",
    hostile.pdf_of_large_inline_images: "image_too_large",
    hostile.png_of_long_profile: "image_damaged",
    hostile.tiff_of_many_samples: "image_damaged",
    hostile.tiff_of_many_tiles: "image_damaged",
    hostile.pdf_of_a_large_image: "image_too_large",
    hostile.pdf_of_a_large_page: "image_too_large",
}


@pytest.mark.parametrize(("build", "code"), REFUSED.items(), ids=lambda case: getattr(case, "__name__", case))
def test_a_hostile_file_is_refused_before_it_takes_time_or_memory(build, code):
    assert code_of(build()) == code


def test_a_drawing_with_some_shadings_is_rendered():
    page = page_of(handed_in(hostile.pdf_of_a_shading(b"/S sh " * 5 + b"0 0 m 842 595 l S")), 1)
    assert page.grey.min() < page.grey.max()


# Largest accepted pictures ------------------------------------------------------------------------

LARGE = """
import sys, numpy as np
sys.path.insert(0, {project!r})
from grader.scan.decode.pages import page_of
print(page_of({path!r}, 1).grey.shape)
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["png16", "tiff_rgb"])
def test_large_accepted_pictures_decode_within_a_workers_memory(tmp_path, kind):
    path = tmp_path / "large"
    if kind == "png16":
        path.write_bytes(hostile.png_of(8_000, 7_000, bits=16, colour=6, data=bytes(7_000 * 64_001), level=1))
    else:
        tifffile.imwrite(path, np.zeros((9_000, 13_000, 3), np.uint8), photometric="rgb", compression="zlib")
    done = subprocess.run(  # noqa: S603 - the test's own script
        [sys.executable, "-c", LARGE.format(project=str(PROJECT), path=str(path))],
        capture_output=True, text=True, check=False, timeout=PATIENCE_S,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (WORKER_BYTES, WORKER_BYTES)),
    )  # fmt: skip
    assert done.stdout.startswith("("), done.stderr


# Sizes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(1, 1), (1, 400), (400, 1), (2, 3000), (33, 33), (60, 1000), (5000, 90)])
def test_any_array_may_be_asked_whether_it_is_blank(shape):
    assert is_blank(Page("a", 1, np.full(shape, 255, np.uint8)))


@pytest.mark.parametrize("seed", range(8))
def test_pages_of_any_accepted_size_come_through_the_sheet_stage(seed):
    rng = np.random.default_rng(seed)
    long_side = int(rng.integers(100, 2500))
    short_side = int(rng.integers(max(100, long_side // 10), long_side + 1))
    shape = (long_side, short_side) if seed % 2 else (short_side, long_side)
    grey = rng.integers(0, 256, shape, dtype=np.uint8) if seed % 3 else hostile.paper(*shape)
    page = page_of(handed_in(hostile.stored(grey)), 1)
    assert page.grey.shape == shape
    register(page)


def surveyed(path):
    """The pages of one file, as a run over its folder finds them."""
    (survey,) = take_inventory(
        [path], path.parent, None, Inline(), lambda *_: None, PageCache(path.parent / "notes")
    )
    return survey.pages


# One page never costs another ---------------------------------------------------------------------


@pytest.mark.parametrize("how", ["page", "image", "content"])
def test_a_broken_page_of_a_class_leaves_the_others_in_their_places(tmp_path, how):
    path = tmp_path / "class.pdf"
    path.write_bytes(hostile.pdf_of_a_class(pages=6, broken=2, how=how))
    pages = surveyed(path)
    assert [source.page for source in pages] == [1, 2, 3, 4, 5, 6]
    told = [source.page for source in pages if (source.blank if how == "content" else source.problem)]
    assert told == [3]
    widths = [page_of(path, number).paper_mm[0] * 72 / 25.4 for number in (1, 2, 4, 5, 6)]
    assert widths == pytest.approx([840, 841, 843, 844, 845])


def test_pages_inherit_what_stands_in_the_list_of_pages():
    with pikepdf.open(io.BytesIO(hostile.pdf_of_a_class(pages=2, broken=9))) as pdf:
        pdf.Root.Pages.MediaBox = pdf.pages[1].MediaBox
        pdf.Root.Pages.Rotate = 90
        del pdf.pages[1].MediaBox
        data = hostile.pdf_bytes(pdf)
    page = page_of(handed_in(data), 2)
    assert (page.turn_deg, page.paper_mm[0]) == (270, pytest.approx(841 / 72 * 25.4))


def test_a_list_of_tiff_pages_that_breaks_off_costs_the_pages_behind_and_no_other():
    two = io.BytesIO()
    first = Image.fromarray(hostile.paper())
    first.save(two, "TIFF", save_all=True, append_images=[first])
    data = bytearray(two.getvalue())
    with tifffile.TiffFile(io.BytesIO(bytes(data))) as file:
        second = file.pages[1].offset
    at = bytes(data).index(second.to_bytes(4, "little"))
    data[at : at + 4] = (len(data) + 1000).to_bytes(4, "little")
    assert count_pages(handed_in(bytes(data))) == 2
    assert page_of(handed_in(bytes(data)), 1).grey.shape == (300, 420)
    assert refused(lambda: page_of(handed_in(bytes(data)), 2)).code == "image_truncated"


def test_pages_that_go_in_a_circle_have_an_end():
    assert count_pages(handed_in(hostile.tiff_whose_pages_go_in_a_circle())) == 1


@pytest.mark.parametrize(
    ("error", "raised"),
    [
        (ZeroDivisionError("odd"), InputFileError),
        (RecursionError(), InputFileError),
        (KeyError("x"), InputFileError),
        (cv2.error("bad"), InputFileError),
        (MemoryError(), MemoryError),
        (cv2.error("(-4:Insufficient memory) Failed to allocate"), MemoryError),
    ],
)
def test_any_error_of_a_library_is_one_of_the_page_but_for_want_of_memory(monkeypatch, error, raised):
    def failing(*_):
        raise error

    monkeypatch.setattr(pictures.cv2, "imdecode", failing)
    with pytest.raises(raised) as caught:
        page_of(handed_in(hostile.stored(hostile.paper())), 1)
    assert getattr(caught.value, "code", "image_damaged") == "image_damaged"


HEALTHY = {
    "png": lambda: hostile.stored(hostile.paper()),
    "jpeg": lambda: hostile.stored(hostile.paper(), "JPEG"),
    "tiff": lambda: hostile.stored(hostile.paper(), "TIFF", compression="tiff_lzw"),
    "fax": lambda: hostile.fax(damaged=False),
    "pdf": lambda: hostile.pdf_of_a_class(pages=2, broken=9),
}


@pytest.mark.parametrize("kind", HEALTHY)
def test_mutated_files_raise_nothing_but_input_errors(kind):
    rng = np.random.default_rng(5)
    whole = HEALTHY[kind]()
    # Headers, lists of pages and trailers are where a byte does most.
    spots = np.concatenate([np.arange(min(800, len(whole))), np.arange(max(0, len(whole) - 800), len(whole))])
    for _ in range(150):
        data = bytearray(whole)
        for at in rng.choice(spots, rng.integers(1, 4)):
            data[at] = rng.integers(0, 256)
        try:
            for number in range(1, min(count_pages(handed_in(bytes(data))), 3) + 1):
                page_of(handed_in(bytes(data)), number)
        except InputFileError as error:
            assert error.code  # noqa: PT017 - any other error is the fault looked for


# The bytes that are hashed are those that are read --------------------------------------------------


def test_a_file_is_read_once_and_its_digest_is_that_of_what_is_decoded(tmp_path):
    path = tmp_path / "scan.png"
    path.write_bytes(hostile.stored(hostile.paper()))
    file = load(path)
    path.write_bytes(hostile.stored(255 - hostile.paper()))
    assert np.array_equal(page_of(file, 1).grey, hostile.paper())
    assert load(path).digest != file.digest


def test_a_page_of_a_file_that_has_changed_since_it_was_surveyed_is_not_read(tmp_path):
    path = tmp_path / "scan.png"
    path.write_bytes(hostile.stored(hostile.paper()))
    digest = surveyed(path)[0].digest
    assert open_page(PageRef("scan.png", digest=digest, path=path)).image is not None
    path.write_bytes(hostile.stored(255 - hostile.paper()))
    changed = open_page(PageRef("scan.png", digest=digest, path=path))
    assert (changed.image, [problem.code for problem in changed.problems]) == (None, ["file_changed"])


def test_a_pipe_is_not_waited_for_and_a_file_of_more_than_a_class_not_loaded(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    assert refused(lambda: load(tmp_path / "pipe.png")).code == "file_missing"
    with (tmp_path / "huge.pdf").open("wb") as file:
        file.truncate(MAX_FILE_BYTES + 1)
    assert refused(lambda: load(tmp_path / "huge.pdf")).code == "file_too_large"


def test_a_file_that_grows_while_it_is_read_is_not_taken_for_whole(tmp_path, monkeypatch):
    path = tmp_path / "scan.png"
    path.write_bytes(bytes(100))
    shorter = os.stat_result((*path.stat()[:6], 50, *path.stat()[7:]))
    monkeypatch.setattr(limits.os, "fstat", lambda _: shorter)
    assert refused(lambda: load(path)).code == "file_changed"


# Damaged rows -------------------------------------------------------------------------------------

FAXES = {
    "T.6": ("group4", {}),
    "T.4 one-dimensional": ("group3", {}),
    "T.4 two-dimensional": ("group3", {292: 1}),
    "T.4 filled": ("group3", {292: 5}),
    "rows at bytes": ("tiff_ccitt", {}),
    "strips": ("group4", {278: 37}),
}
DRAWINGS = {
    "lines": hostile.paper(200, 1000) >= 128,
    "grain": np.random.default_rng(2).random((150, 333)) < 0.5,
    "empty": np.ones((710, 7000), bool),
    "black": np.zeros((540, 5300), bool),
    "edges": np.tile(np.array([0, 1] * 60, bool), (110, 1)) ^ (np.arange(110)[:, None] % 3 > 0),
}


@pytest.mark.parametrize("drawing", DRAWINGS)
@pytest.mark.parametrize("coding", FAXES)
def test_whole_faxes_are_accepted(drawing, coding):
    compression, tags = FAXES[coding]
    bits = DRAWINGS[drawing]
    page = page_of(handed_in(hostile.stored(bits, "TIFF", compression=compression, tiffinfo=tags)), 1)
    assert page.damage == ()


def strip_of(data):
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        page = file.pages[0]
        return page.dataoffsets[0], page.databytecounts[0]


ALIKE_SHARE = 0.25
"""Share of flipped bits that put a valid code in another's place, such as an edge 1 px right for left.

No decoder can tell these from a drawing.
"""


@pytest.mark.parametrize("coding", ["group4", "group3"])
def test_flipped_bits_of_a_fax_are_seen_but_for_those_that_leave_valid_codes(coding):
    whole = hostile.fax(damaged=False, compression=coding)
    grey = page_of(handed_in(whole), 1).grey
    offset, length = strip_of(whole)
    rng = np.random.default_rng(11)
    counted = Counter()
    for _ in range(60):
        data = bytearray(whole)
        data[offset + rng.integers(2, length - 4)] ^= 1 << int(rng.integers(8))
        try:
            page = page_of(handed_in(bytes(data)), 1)
        except InputFileError:
            counted["refused"] += 1
            continue
        same = not page.damage and np.array_equal(page.grey, grey)
        counted["flagged" if page.damage else "same" if same else "other"] += 1
    assert counted["flagged"] + counted["refused"] > 40
    assert counted["other"] <= ALIKE_SHARE * 60


def test_the_first_damaged_row_is_named():
    bits = hostile.paper(600, 840) >= 128
    whole = hostile.fax(damaged=False)
    offset, length = strip_of(whole)
    above = hostile.stored(bits[:300], "TIFF", compression="group4", tiffinfo={278: 300})
    start, size = strip_of(above)
    # The end-of-block of 300 rows stands where row 301 should.
    data = above[start : start + size] + whole[offset + size : offset + length]
    assert damaged_row(data, 840, 600, Coding()) == 300
    assert damaged_row(whole[offset : offset + length], 840, 600, Coding()) is None
    assert damaged_row(whole[offset : offset + length // 2], 840, 600, Coding()) is not None


def fax_pdf(damaged, stamp=b""):
    data = hostile.fax(damaged=damaged)
    offset, length = strip_of(data)
    pdf = pikepdf.new()
    image = pikepdf.Stream(pdf, data[offset : offset + length])
    image.stream_dict = pikepdf.Dictionary(
        Type=pikepdf.Name.XObject, Subtype=pikepdf.Name.Image, Width=840, Height=600, BitsPerComponent=1,
        ColorSpace=pikepdf.Name.DeviceGray, Filter=pikepdf.Name.CCITTFaxDecode,
        DecodeParms=pikepdf.Dictionary(K=-1, Columns=840, Rows=600, BlackIs1=True),
    )  # fmt: skip
    page = pdf.add_blank_page(page_size=(840, 600))
    page.Resources = pikepdf.Dictionary(XObject=pikepdf.Dictionary(Scan=pdf.make_indirect(image)))
    page.Contents = pdf.make_stream(b"q 840 0 0 600 0 0 cm /Scan Do Q " + stamp)
    return hostile.pdf_bytes(pdf)


@pytest.mark.parametrize("stamp", [b"", b"0 0 20 20 re f"])
def test_damaged_rows_are_seen_in_a_pdf_too(stamp):
    assert page_of(handed_in(fax_pdf(damaged=False, stamp=stamp)), 1).damage == ()
    assert page_of(handed_in(fax_pdf(damaged=True, stamp=stamp)), 1).damage[0] > 1


def test_a_page_with_damaged_rows_is_told_and_not_read(tmp_path):
    path = tmp_path / "copy.tif"
    path.write_bytes(hostile.fax())
    page = open_page(PageRef("copy.tif", path=path))
    assert [problem.code for problem in page.problems] == ["image_damaged_rows"]
    assert page.sheet is None
    assert not surveyed(path)[0].blank


@pytest.mark.parametrize("compression", ["tiff_lzw", "packbits", "tiff_adobe_deflate"])
def test_a_tiff_that_lost_bytes_is_refused(compression):
    grey = hostile.paper(600, 840)
    whole = hostile.stored(grey, "TIFF", compression=compression, tiffinfo={278: 600})
    offset, length = strip_of(whole)
    data = bytearray(whole)
    data[offset + length // 2 : offset + length - 8] = data[offset + length // 2 + 8 : offset + length]
    assert code_of(bytes(data)) in {"image_damaged", "image_truncated"}
