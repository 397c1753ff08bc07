"""One student's work from the task to the files: the run of a simulation, read top to bottom."""

import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pikepdf
from numpy.typing import NDArray
from PIL import Image

from reference.authored.assignment import Assignment, Variant
from reference.mechanism import Crank
from samples.simulation import truth
from samples.simulation.desk import Desk, Printed
from samples.simulation.hand import DrawnSheet, draw, task_of
from samples.simulation.scanner import DrawnPaper, digitise
from samples.simulation.settings import MECHANISM, VELOCITY, Scan, Settings
from samples.simulation.strokes import Rng
from samples.simulation.view import view_of

_EXIF_ORIENTATION = {1: 6, 2: 3, 3: 8}
"""The tag that undoes so many quarter turns counter-clockwise."""

Pixels = NDArray[np.uint8]


def encoded(image: Pixels, scan: Scan, *, exif: bool = False) -> bytes:
    """The file's bytes in the scan's container (a PDF's pages are JPEG)."""
    picture = Image.fromarray(image)
    if scan.mode == "bilevel":
        picture = picture.convert("1", dither=Image.Dither.NONE)
    tags: dict[str, Any] = {} if scan.dpi_tag is None else {"dpi": (scan.dpi_tag, scan.dpi_tag)}
    buffer = io.BytesIO()
    if scan.container == "png":
        picture.save(buffer, "PNG", compress_level=6, **tags)
    elif scan.container == "tif":
        compression = "group4" if scan.mode == "bilevel" else "tiff_lzw"
        picture.save(buffer, "TIFF", compression=compression, **tags)
    else:
        if exif and scan.quarter_turns % 4:
            marks = Image.Exif()
            marks[0x0112] = _EXIF_ORIENTATION[scan.quarter_turns % 4]
            tags["exif"] = marks
        flat = picture.convert("L") if scan.mode == "bilevel" else picture
        flat.save(buffer, "JPEG", quality=scan.jpeg_tables or scan.jpeg_quality, **tags)
    return buffer.getvalue()


def blank_back(scan: Scan, shape: tuple[int, int], rng: np.random.Generator) -> Pixels:
    """The scan of an empty back: paper, noise, a few specks."""
    grey = 0.299 * scan.paper[0] + 0.587 * scan.paper[1] + 0.114 * scan.paper[2]
    plane = np.full(shape, grey, np.float32) + rng.standard_normal(shape, dtype=np.float32) * scan.noise
    for _ in range(6):
        row, column = rng.integers(0, shape[0]), rng.integers(0, shape[1])
        plane[row : row + 3, column : column + 2] -= 70
    return np.asarray(np.clip(plane, 0, 255).astype(np.uint8))


def write_pdf(path: Path, pages: Iterable[tuple[Pixels, float, int]], quality: int = 80) -> None:
    """One PDF of many pages, a JPEG each.

    Arguments: pages as (image, dpi, quarter turns that viewers are to undo).
    """
    document = pikepdf.new()
    for image, dpi, turns in pages:
        height, width = image.shape[:2]
        scan = Scan(jpeg_quality=quality, dpi_tag=None, mode="colour" if image.ndim == 3 else "grey")
        stream = pikepdf.Stream(document, encoded(image, scan))
        stream.stream_dict = pikepdf.Dictionary(
            Type=pikepdf.Name.XObject,
            Subtype=pikepdf.Name.Image,
            Width=width,
            Height=height,
            ColorSpace=pikepdf.Name.DeviceRGB if image.ndim == 3 else pikepdf.Name.DeviceGray,
            BitsPerComponent=8,
            Filter=pikepdf.Name.DCTDecode,
        )
        w, h = width / dpi * 72.0, height / dpi * 72.0
        content = pikepdf.Stream(document, f"q {w:.4f} 0 0 {h:.4f} 0 0 cm /Im0 Do Q".encode())
        page = pikepdf.Dictionary(
            Type=pikepdf.Name.Page,
            MediaBox=[0, 0, w, h],
            Rotate=90 * (turns % 4),
            Resources=pikepdf.Dictionary(XObject=pikepdf.Dictionary(Im0=document.make_indirect(stream))),
            Contents=document.make_indirect(content),
        )
        document.pages.append(pikepdf.Page(document.make_indirect(page)))
    document.save(path, deterministic_id=True)


def write_truth(path: Path, truths: Sequence[dict[str, Any]]) -> None:
    """Write JSON lines, one per sheet."""
    lines = [json.dumps(truth, ensure_ascii=False, sort_keys=True) for truth in truths]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


_SHRINK = (1.0, 0.9, 0.8, 0.66, 0.5, 0.4)
"""Lengths of the crank tried, as shares of the one wished for."""


@dataclass(frozen=True, slots=True)
class SimulatedSheet:
    """One page: its stored image, and its truth as JSON-like data."""

    image: NDArray[np.uint8]
    truth: dict[str, Any]
    settings: Settings

    @property
    def suffix(self) -> str:
        """The file name's ending."""
        return f".{self.settings.scan.container}"

    def save(self, path: Path) -> Path:
        """Write the file (its ending set by the scan's container); the truth then names it.

        A phone's picture states its orientation in EXIF.
        """
        target = path.with_name(path.name + self.suffix)
        scan = self.settings.scan
        if scan.container == "pdf":
            write_pdf(target, [(self.image, scan.dpi, 0)], scan.jpeg_quality)
        else:
            target.write_bytes(encoded(self.image, scan, exif=scan.device == "phone"))
        self.truth.update({"file": target.name, "page": 1})
        return target


def simulate(  # noqa: PLR0913 - the last only spares what nobody looks at
    assignment: Assignment,
    variant: Variant,
    seed: int,
    settings: Settings | None = None,
    *,
    student_id: str = "s01",
    printed: Printed | None = None,
    most: int | None = None,
) -> list[SimulatedSheet]:
    """Simulate a student's sheets, in the order of drawing.

    Arguments: `printed` gives answer sheets by kind of page (``all``, ``velocity``,
    ``acceleration``), drawn on instead of plain paper; of more sheets than `most` only the first are
    scanned. Raises ValueError where a mistake asked for cannot be made.
    """
    desk, drawn = drawn_by(assignment, variant, seed, settings, student_id=student_id, printed=printed)
    return [scanned(desk, sheet, (number, len(drawn))) for number, sheet in enumerate(drawn[:most], start=1)]


def drawn_by(
    assignment: Assignment,
    variant: Variant,
    seed: int,
    settings: Settings | None = None,
    *,
    student_id: str = "s01",
    printed: Printed | None = None,
) -> tuple[Desk, tuple[DrawnSheet, ...]]:
    """The student's desk and figures before they are inked, as `simulate` uses them."""
    chosen = settings or Settings()
    if printed is not None:
        chosen = replace(chosen, student=replace(chosen.student, sheets=1 if "all" in printed else 2))
    for share in _SHRINK:
        tried = _with_crank(assignment, variant, chosen, share)
        task = task_of(assignment, variant, tried.student, np.random.default_rng([seed, 0]))
        desk = Desk(task, tried, printed, student_id, seed)
        drawn = draw(task, tried.hand, tried.student, np.random.default_rng([seed, 1]))
        if all(desk.fits(sheet) for sheet in drawn):
            return desk, drawn
    return desk, tuple(one for sheet in drawn for one in _split(sheet))


def _with_crank(assignment: Assignment, variant: Variant, settings: Settings, share: float) -> Settings:
    """The settings with a share of the crank's proposed length, to fit the paper."""
    if share == 1.0:
        return settings
    if assignment.forces is not None:
        student = settings.student
        force_mm, crank_mm = share * student.largest_force_mm, student.crank_mm and share * student.crank_mm
        return replace(settings, student=replace(student, largest_force_mm=force_mm, crank_mm=crank_mm))
    driver = assignment.mechanism([variant]).driver
    if not isinstance(driver, Crank):
        return replace(settings, student=replace(settings.student, shrunk=share))
    proposed = float(assignment.scales([variant]).kL[0])
    wished = settings.student.crank_mm or float(driver.length_m.reshape(-1)[0]) / proposed
    return replace(settings, student=replace(settings.student, crank_mm=float(round(wished * share))))


def _split(sheet: DrawnSheet) -> list[DrawnSheet]:
    """Split a sheet in two: mechanism and velocity plan, acceleration plan."""
    if sheet.kind != "all":
        return [sheet]
    first = tuple(f for f in sheet.figures if f.name in {MECHANISM, VELOCITY})
    rest = tuple(f for f in sheet.figures if f not in first)
    return [DrawnSheet("velocity", first), DrawnSheet("acceleration", rest)]


def scanned(desk: Desk, sheet: DrawnSheet, number: tuple[int, int]) -> SimulatedSheet:
    """Draw the sheet and scan it."""
    settings = desk.settings
    sketch, told, frame = desk.draw_out(sheet, number)
    rng = np.random.default_rng([desk.seed, 3, number[0]])
    view = view_of(settings.scan, rng)
    background = None if desk.printed is None else desk.printed[sheet.kind].background
    page = settings.page
    paper = DrawnPaper(sketch.strokes, settings.pen, background, page.squares, page.squares_broken)
    image = digitise(paper, settings.scan, view, rng)
    about = {"student_id": desk.student_id, "seed": desk.seed, "page": number[0]}
    return SimulatedSheet(image, {**told, **truth.scan_truth(view, frame, settings), **about}, settings)


def measured_by(
    sheets: Sequence[SimulatedSheet], rng: Rng, spread_mm: float = 0.2, step_mm: float = 0.5
) -> dict[str, float]:
    """Readings of the student's ruler and protractor: lengths in mm by vector, ``NAME_deg`` directions."""
    measured: dict[str, float] = {}
    plans = [figure for sheet in sheets for figure in sheet.truth["figures"].values()]
    for name, vector in (item for plan in plans for item in plan.get("vectors", {}).items()):
        length = vector["length_mm"] + rng.normal(0.0, spread_mm)
        measured[name] = round(max(0.0, round(length / step_mm) * step_mm), 3)
        if vector["direction_deg"] is not None and vector["length_mm"] > 5.0:
            measured[f"{name}_deg"] = round(vector["direction_deg"] + rng.normal(0.0, 0.4)) % 360
    return measured
