"""Flaws of a picture are found where they are, and nowhere else."""

import io
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from PIL.ExifTags import IFD, Base

from grader.language import LANGUAGES, tongue
from grader.records import GreyImage, Page, Reason, Sheet
from grader.scan.decode.pages import page_of
from grader.scan.quality import CAMERA, COPIER, FLAWS, LEAST_DPI, MOST_BLUR_MM, SCANNER, device_of, flaws
from grader.scan.register.registration import register
from grader.texts.problems import ADVICE
from grader.texts.spoken import sentence
from tests.bench.reading_scenes import ReadingScene, work
from tests.examples import slow

REAL = Path(__file__).parents[4] / "shared" / "real"
PRINTED = ReadingScene("photo", "", device="phone", dpi=None, printed=True, hardship=0.0)
PLAIN = ReadingScene("photo", "", device="phone", dpi=None, hardship=0.0)


@cache
def photo(scene: ReadingScene, seed: int) -> tuple[Page, float]:
    """A photo, as the camera stored it, and its pixels per mm."""
    (sheet,) = work(scene, seed, most=1).sheets
    grey = sheet.image if sheet.image.ndim == 2 else cv2.cvtColor(sheet.image, cv2.COLOR_RGB2GRAY)
    turn = round(-sheet.truth["rotation_deg"] / 90.0) * 90 % 360
    return Page("photo.jpg", 1, np.asarray(grey, dtype=np.uint8), turn_deg=turn), sheet.truth["px_per_mm"]


@pytest.fixture(scope="module")
def good() -> tuple[Page, float]:
    return photo(PRINTED, 1)


def flaws_of(page: Page) -> dict[str, Reason]:
    """The flaws of a page, registered if it can be."""
    sheet, _ = register(page)
    return {flaw.code: flaw for flaw in flaws(page, sheet if isinstance(sheet, Sheet) else None)}


def defocused(grey: GreyImage, px_per_mm: float) -> GreyImage:
    side = 2 * round(0.75 * px_per_mm) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)).astype(np.float32)
    return np.asarray(cv2.filter2D(grey, -1, disc / disc.sum()), dtype=np.uint8)


def shaken(grey: GreyImage, px_per_mm: float) -> GreyImage:
    return np.asarray(cv2.blur(grey, (1, round(1.8 * px_per_mm))), dtype=np.uint8)


def underexposed(grey: GreyImage, _px_per_mm: float) -> GreyImage:
    return np.asarray(255.0 * (grey / 255.0) ** 8 * 0.3, dtype=np.uint8)


def shaded(grey: GreyImage, px_per_mm: float) -> GreyImage:
    """A hard-edged shadow over a corner."""
    high, wide = grey.shape
    mask = np.ones(grey.shape, np.float32)
    cv2.fillPoly(mask, [np.array([(0, 0), (0.6 * wide, 0), (0, 0.7 * high)], np.int32)], 0.1)
    return np.asarray(grey * cv2.GaussianBlur(mask, (0, 0), 3.0 * px_per_mm), dtype=np.uint8)


def reflecting(grey: GreyImage, px_per_mm: float) -> GreyImage:
    spot = np.zeros(grey.shape, np.float32)
    high, wide = grey.shape
    cv2.ellipse(spot, (wide // 2, high // 2), (wide // 7, high // 11), 30.0, 0.0, 360.0, 255.0, -1)
    return np.asarray(np.clip(grey + cv2.GaussianBlur(spot, (0, 0), 2.0 * px_per_mm), 0, 255), dtype=np.uint8)


def bright(grey: GreyImage, _px_per_mm: float) -> GreyImage:
    return np.clip(grey.astype(np.float32) * 2.2, 0, 255).astype(np.uint8)


def reduced(grey: GreyImage, _px_per_mm: float) -> GreyImage:
    """As a messenger sends it: 1600 pixels."""
    scale = 1600.0 / max(grey.shape)
    return np.asarray(
        cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR), dtype=np.uint8
    )


def far_away(grey: GreyImage, _px_per_mm: float) -> GreyImage:
    small = cv2.resize(grey, None, fx=0.55, fy=0.55, interpolation=cv2.INTER_AREA)
    table = np.full(grey.shape, 70, np.uint8)
    table[200 : 200 + small.shape[0], 300 : 300 + small.shape[1]] = small
    return table


def slanted(grey: GreyImage, _px_per_mm: float) -> GreyImage:
    high, wide = grey.shape
    corners = np.array([(0, 0), (wide, 0), (wide, high), (0, high)], np.float32)
    onto = np.array([(0.3 * wide, 0.1 * high), (0.7 * wide, 0.1 * high), (wide, high), (0, high)], np.float32)
    matrix = cv2.getPerspectiveTransform(corners, onto)
    return np.asarray(cv2.warpPerspective(grey, matrix, (wide, high), borderValue=70), dtype=np.uint8)


SPOILT: dict[str, Callable[[GreyImage, float], GreyImage]] = {
    "too_dark": underexposed,
    "shadow": shaded,
    "glare": reflecting,
    "too_coarse": reduced,
    "far_away": far_away,
    "too_tilted": slanted,
}


@pytest.mark.parametrize("code", SPOILT)
def test_a_photo_that_is_spoilt_is_told_what_spoils_it(good: tuple[Page, float], code: str) -> None:
    page, px_per_mm = good
    assert code in flaws_of(replace(page, grey=SPOILT[code](page.grey, px_per_mm)))


@pytest.mark.parametrize(
    ("spoil", "scene", "seed"),
    [
        (defocused, PRINTED, 1),
        (shaken, PRINTED, 1),
        *slow((shaken, PLAIN, 1), (shaken, PRINTED, 2), (shaken, PRINTED, 5)),
    ],
)
def test_blur_is_measured_in_the_direction_in_which_it_is_worst(
    spoil: Callable[[GreyImage, float], GreyImage], scene: ReadingScene, seed: int
) -> None:
    page, px_per_mm = photo(scene, seed)
    flaw = flaws_of(replace(page, grey=spoil(page.grey, px_per_mm)))["blurred"]
    assert MOST_BLUR_MM < flaw.parameters["measured"] < 3.0


def test_a_scan_whose_paper_was_made_white_is_not_overexposed() -> None:
    grey = np.full((1754, 2480), 255, np.uint8)
    for row in range(300, 1500, 200):
        cv2.line(grey, (300, row), (2100, row + 60), 190, 2)
    scanned = np.diag([5.906, 5.906, 1.0])
    sheet = Sheet(scanned, (420.0, 297.0), "combined", 5.906, 0.0, 0.1, 0.001, (10, 10, 400, 277))
    page = Page("scan.jpg", 1, grey, (150.0, 150.0))
    assert flaws(page, sheet) == ()
    cropped = replace(page, dpi=None, grey=np.ascontiguousarray(grey[:-40, :-40]))
    for unplaced in (page, cropped):
        assert {flaw.code for flaw in flaws(unplaced, None)} == {"no_sheet"}
    tilt = np.zeros((3, 3))
    tilt[2, 0] = 1e-5  # as of a frame ruled 2 mm askew
    assert flaws(cropped, replace(sheet, mm_to_px=scanned + tilt)) == ()
    assert "overexposed" in {flaw.code for flaw in flaws(page, replace(sheet, mm_to_px=scanned + 30 * tilt))}


# Advice fits the device --------------------------------------------------------------------------

OF_ANOTHER = {
    CAMERA: r"scan|glass|lid\b|copier|scane|sticl|capac|copiator|скан|стекл|крышк|копир",
    SCANNER: r"phone|lens|flash|lamp|camera|table|telefon|bliț|obiectiv|lampă|телефон|вспышк|объектив|ламп",
}
OF_ANOTHER[COPIER] = OF_ANOTHER[SCANNER]


@pytest.mark.parametrize("device", FLAWS)
def test_every_flaw_has_advice_for_the_devices_that_can_have_it_and_for_no_other(device: str) -> None:
    assert {code for code, by in ADVICE.items() if device in by} == FLAWS[device]
    known = {"measured": 90, "limit": 150, "areas": ("middle",), "corners": ("upper_left",), "device": device}
    for code in FLAWS[device]:
        said = {lang: sentence(Reason(code, known), tongue(lang)) for lang in LANGUAGES}
        least = {sentence(Reason(code), tongue(lang)) for lang in LANGUAGES}
        assert len({*said.values()} - least) == len(LANGUAGES), code
        assert not [text for text in said.values() if re.search(OF_ANOTHER[device], text, re.IGNORECASE)]


SPOILERS = (defocused, underexposed, shaded, reflecting, bright, reduced, far_away)


@pytest.mark.parametrize("device", FLAWS)
def test_each_way_to_spoil_a_picture_is_tried_on_each_device(device: str) -> None:
    kind = {CAMERA: "phone", SCANNER: "flatbed", COPIER: "copier"}[device]
    dpi = None if device == CAMERA else 200.0
    page, px_per_mm = photo(ReadingScene("try", "", device=kind, dpi=dpi), 5)  # type: ignore[arg-type]
    told = set[str]()
    for spoil in SPOILERS:
        grey = spoil(page.grey, px_per_mm)
        if device == COPIER:
            grey = np.where(grey > 127, 255, 0).astype(np.uint8)
        stated = None if dpi is None else (dpi * len(grey) / len(page.grey),) * 2
        found = flaws_of(replace(page, grey=np.ascontiguousarray(grey), dpi=stated))
        assert {flaw.parameters["device"] for flaw in found.values()} <= {device}, spoil
        told |= found.keys()
    assert told <= FLAWS[device]
    assert told > ({"overexposed", "glare", "blurred"} if device == CAMERA else {"too_coarse", "shadow"})


def jpeg(
    where: Path, shape: tuple[int, int] = (300, 420), exif: Image.Exif | None = None, **more: object
) -> Page:
    Image.new("L", shape[::-1], 230).save(where, "JPEG", exif=Image.Exif() if exif is None else exif, **more)
    return page_of(where, 1)


def test_a_file_says_what_made_it_or_its_size_resolution_and_shape_do(tmp_path: Path) -> None:
    for tags, device in [
        ({Base.FNumber: 1.8}, CAMERA),
        ({Base.FileSource: b"\3"}, CAMERA),
        ({Base.FileSource: b"\2"}, SCANNER),
    ]:
        exif = Image.Exif()
        exif.get_ifd(IFD.Exif).update(tags)
        # In spite of a resolution, and of a shape, that speak for another.
        page = jpeg(tmp_path / "a.jpg", (300, 400), exif, dpi=(72, 72) if device == SCANNER else (300, 300))
        assert device_of(page, None) == page.device == device
    tiff = io.BytesIO()
    Image.new("L", (400, 300), 230).save(tiff, "TIFF")
    (tmp_path / "a.tif").write_bytes(tiff.getvalue())
    assert device_of(page_of(tmp_path / "a.tif", 1), None) == SCANNER
    shapes = [
        ((600, 800), {}, CAMERA),
        ((600, 800), {"dpi": (72, 72)}, CAMERA),
        ((600, 800), {"dpi": (300, 300)}, SCANNER),
    ]
    shapes += [((2339, 1654), {}, SCANNER), ((700, 811), {}, SCANNER)]
    for shape, more, device in shapes:
        assert device_of(jpeg(tmp_path / "b.jpg", shape, **more), None) == device, (shape, more)
    assert device_of(jpeg(tmp_path / "b.jpg", (700, 811)), None, sees_edges=True) == CAMERA


def test_an_a4_scan_is_not_told_to_be_scanned_at_the_resolution_that_it_has(tmp_path: Path) -> None:
    page = jpeg(tmp_path / "a4.jpg", (1654, 2339), dpi=(200, 200))
    assert {flaw.code for flaw in flaws(page, None)} == {"no_sheet"}
    ((code, known),) = [(one.code, one.parameters) for one in flaws(replace(page, dpi=(120.0, 120.0)), None)]
    assert (code, known["measured"], known["device"]) == ("too_coarse", 120, SCANNER)


def test_faded_lines_of_an_overexposed_photo_are_told_on_plain_and_printed_sheets(
    good: tuple[Page, float],
) -> None:
    for page in (good[0], photo(PLAIN, 1)[0]):
        assert "overexposed" in flaws_of(replace(page, grey=bright(page.grey, 0.0)))


@pytest.mark.parametrize("scene", [PRINTED, *slow(PLAIN)])
def test_the_corners_that_are_not_in_the_picture_are_named(scene: ReadingScene) -> None:
    page, _ = photo(scene, 2)
    assert page.turn_deg == 0
    high, wide = page.grey.shape
    for keep, corners in [
        ((slice(0, round(0.8 * high)), slice(0, wide)), {"lower_left", "lower_right"}),
        ((slice(0, high), slice(round(0.2 * wide), wide)), {"upper_left", "lower_left"}),
    ]:
        flaw = flaws_of(replace(page, grey=np.ascontiguousarray(page.grey[keep])))["corner_cut"]
        assert set(flaw.parameters["corners"]) == corners


def test_a_picture_without_a_sheet_is_told_and_a_turned_sheet_is_none() -> None:
    rng = np.random.default_rng(1)
    soft = cv2.GaussianBlur(rng.uniform(0, 255, (2100, 2800)).astype(np.float32), (0, 0), 25.0)
    noise = cv2.normalize(soft, None, 0, 255, cv2.NORM_MINMAX)
    assert set(flaws_of(Page("garden.jpg", 1, np.asarray(noise, dtype=np.uint8)))) == {"no_sheet"}
    page, _ = photo(PRINTED, 2)
    assert not flaws_of(replace(page, grey=np.ascontiguousarray(np.rot90(page.grey)), turn_deg=270))


@pytest.mark.parametrize("seed", [1, *slow(40, 41, 42, 43)])
def test_good_photos_have_no_flaw(seed: int) -> None:
    for scene in (PRINTED, PLAIN):
        assert not flaws_of(photo(scene, seed)[0])


@pytest.mark.parametrize(
    ("device", "seed"), [("flatbed", 1), ("copier", 1), *slow(("flatbed", 2), ("copier", 2))]
)
def test_scans_and_copies_have_no_flaw(device: str, seed: int) -> None:
    scene = ReadingScene("scan", "", device=device, dpi=200.0, hardship=0.0)  # type: ignore[arg-type]
    assert not flaws_of(photo(scene, seed)[0])


def test_a_scan_at_a_low_resolution_is_told_its_dots_per_inch() -> None:
    page, _ = photo(ReadingScene("scan", "", dpi=100.0, hardship=0.0), 1)
    flaw = flaws_of(page)["too_coarse"]
    assert flaw.parameters["measured"] == pytest.approx(100.0, rel=0.03)
    assert flaw.parameters["limit"] == LEAST_DPI


@pytest.mark.skipif(not REAL.is_dir(), reason="real pictures are not in the repository")
@pytest.mark.parametrize(
    "name", ["ruled/t16-p5.png", "hdBPMN/ex07_writer0049.jpg", "noteshrink/graph-paper-front.jpg"]
)
def test_real_scans_of_pencil_and_print_are_not_blurred(name: str) -> None:
    page = page_of(REAL / name, 1)
    assert "blurred" not in {flaw.code for flaw in flaws(page, None)}


@pytest.mark.skipif(not REAL.is_dir(), reason="real pictures are not in the repository")
@pytest.mark.parametrize("name", ["ruled/t16-p5.png", "ruled/zds-p9-0.png", "hdBPMN/ex08_writer0049.jpg"])
def test_real_scans_are_told_nothing_about_phones(name: str) -> None:
    assert {flaw.parameters["device"] for flaw in flaws(page_of(REAL / name, 1), None)} == {SCANNER}
