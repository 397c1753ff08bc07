"""A mixed class: hands, habits, pens, pages and scanners drawn at random."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from reference.authored.assignment import Assignment, Variant
from samples.simulation.hand import possible_mistakes
from samples.simulation.mistakes import CODES
from samples.simulation.settings import (
    CAREFUL,
    SLOPPY,
    TYPICAL,
    Colour,
    HandStyle,
    PageStyle,
    PenStyle,
    Scan,
    Settings,
    Student,
)
from samples.simulation.strokes import Rng

Device = Literal["flatbed", "copier", "phone"]


def any_settings(
    seed: int,
    *,
    device: Device | None = None,
    dpi: float | None = None,
    mistakes: float = 0.5,
    work: tuple[Assignment, Variant] | None = None,
    hardship: float = 1.0,
) -> Settings:
    """Random settings of a mixed class: hand, habits, pen, page and scanner, by the seed.

    Arguments
    ---------
    device, dpi : fixed where given
    mistakes : mean number of mistakes
    work : the drawing; if given, only mistakes that it admits are chosen. Without it any code may be
        chosen, and `simulate` refuses one that cannot be made
    hardship : multiplies the chances of things that make a sheet hard to read (`HARDSHIPS`), 0 for none
    """
    rng = np.random.default_rng([seed, 7])
    hand = (CAREFUL, TYPICAL, SLOPPY)[rng.choice(3, p=[0.35, 0.45, 0.2])]
    page = any_page(rng)
    codes = CODES if work is None or not mistakes else possible_mistakes(*work, Student())
    student = any_student(rng, mistakes, codes)
    if work is not None and student.mistakes:
        # At this student's own scales a mistake may put a node off the paper.
        able = possible_mistakes(*work, student, student.mistakes)
        student = replace(student, mistakes=able)
    pen = replace(any_pen(rng, hand), sums=_any_sums(np.random.default_rng([seed, 11])))
    settings = Settings(hand, student, pen, page, any_scan(rng, device, dpi))
    return with_hardships(settings, np.random.default_rng([seed, 8]), hardship)


HARDSHIPS: Mapping[str, float] = {
    "faint pencil": 0.06, "soft and smeared": 0.08, "blue ink": 0.05, "outlined arrowheads": 0.08,
    "dashed construction": 0.1, "badly erased": 0.1, "whole plan crossed out": 0.05, "stray lines": 0.15,
    "letters on lines": 0.2, "stains": 0.06, "sharp folds": 0.08, "strong show-through": 0.05,
    "squared paper": 0.03,
}  # fmt: skip
"""Things that make a sheet hard to read, each with its share of students; several may occur together."""


def with_hardships(settings: Settings, rng: Rng, times: float = 1.0) -> Settings:
    """Settings with random hardships, at `times` their usual chances."""
    student, pen, page, scan = settings.student, settings.pen, settings.page, settings.scan
    met = {name for name, share in HARDSHIPS.items() if rng.random() < times * share}
    # All random numbers below are always drawn, so that one hardship does not change another.
    size = dict(zip(sorted(HARDSHIPS), rng.uniform(0.0, 1.0, len(HARDSHIPS)).tolist(), strict=True))
    return Settings(
        settings.hand, _harder_student(student, met, size), _harder_pen(pen, met, size),
        _harder_page(page, met, size), _harder_scan(scan, met, size),
    )  # fmt: skip


def _harder_student(student: Student, met: set[str], size: Mapping[str, float]) -> Student:
    if "whole plan crossed out" in met:
        student = replace(student, abandoned=True, abandoned_whole=True)
    if "stray lines" in met:
        student = replace(student, helpers=1 + int(5 * size["stray lines"]))
    return student


def _harder_pen(pen: PenStyle, met: set[str], size: Mapping[str, float]) -> PenStyle:
    if "faint pencil" in met:
        pale = 0.26 + 0.12 * size["faint pencil"]
        pen = replace(pen, line_mm=0.3, thin_mm=0.2, dark=pale, thin_dark=0.5 * pale, colour=_GRAPHITE)
    if "soft and smeared" in met:
        smear = 0.06 + 0.12 * size["soft and smeared"]
        pen = replace(pen, line_mm=0.65, thin_mm=0.35, grain=0.6, smear=smear, colour=_GRAPHITE, smudges=4)
    if "blue ink" in met:
        pen = replace(pen, plan_colour=_BLUE, dark=0.9, grain=0.05)
    if "outlined arrowheads" in met:
        pen = replace(pen, arrow="closed")
    if "dashed construction" in met:
        pen = replace(pen, construction_dashed=0.3 + 0.7 * size["dashed construction"])
    if "badly erased" in met:
        pen = replace(pen, ghost_dark=0.14 + 0.1 * size["badly erased"], erased=0.6)
    return pen


def _harder_page(page: PageStyle, met: set[str], size: Mapping[str, float]) -> PageStyle:
    if "letters on lines" in met:
        page = replace(page, letters_touch=0.2 + 0.8 * size["letters on lines"])
    return replace(page, squared_mm=5.0) if "squared paper" in met else page


def _harder_scan(scan: Scan, met: set[str], size: Mapping[str, float]) -> Scan:
    if "stains" in met:
        scan = replace(scan, stains=1 + int(3 * size["stains"]))
    if "sharp folds" in met:
        scan = replace(scan, fold=True, crease=1.5 + 2.5 * size["sharp folds"])
    if "strong show-through" in met:
        scan = replace(scan, show_through=0.1 + 0.1 * size["strong show-through"])
    return scan


_GRAPHITE: Colour = (78, 78, 82)
_BLUE: Colour = (30, 50, 140)


def any_student(rng: Rng, mistakes: float, possible: Sequence[str] = CODES) -> Student:
    """A random student's choices; mistakes are taken from the possible ones."""
    count = min(2, int(rng.poisson(mistakes)))
    codes = rng.choice(np.array(possible), size=count, replace=False)
    return Student(
        crank_mm=None if rng.random() < 0.5 else float(rng.choice([50.0, 55.0, 60.0])),
        ka_ratio=float(rng.choice([1.0, 1.25, 0.8], p=[0.7, 0.15, 0.15])),
        kv_ratio=float(rng.choice([1.0, 1.25, 0.8], p=[0.84, 0.08, 0.08])),
        similarity=bool(rng.random() < 0.3),
        turn_deg=float(rng.choice([0.0, rng.normal(0, 0.4), rng.normal(0, 3.0)], p=[0.5, 0.4, 0.1])),
        mistakes=tuple(str(code) for code in codes),
        sheets=2 if rng.random() < 0.35 else 1,
        vectors_on_mechanism=bool(rng.random() < 0.35),
        altitude=bool(rng.random() < 0.15),
        omitted=float(rng.choice([0.0, 0.25], p=[0.7, 0.3])),
        abandoned=bool(rng.random() < 0.06),
    )


PENS: dict[str, PenStyle] = {
    "soft pencil": PenStyle(0.55, 0.3, 0.72, 0.38, 0.16, 0.05, 0.5, (62, 62, 66)),
    "hard pencil": PenStyle(0.32, 0.2, 0.5, 0.24, 0.1, 0.035, 0.4, (84, 84, 88)),
    "fine pencil": PenStyle(0.4, 0.25, 0.62, 0.34, 0.08, 0.03, 0.3, (70, 70, 72)),
    "ink": PenStyle(0.5, 0.25, 0.96, 0.9, 0.04, 0.03, 0.03, (24, 24, 28)),
    "ballpoint": PenStyle(0.42, 0.3, 0.85, 0.7, 0.12, 0.06, 0.12, (34, 44, 120)),
    "coloured": PenStyle(0.45, 0.25, 0.74, 0.4, 0.12, 0.05, 0.3, (66, 66, 70), (150, 36, 40)),
    "felt": PenStyle(0.7, 0.35, 0.95, 0.85, 0.06, 0.05, 0.02, (30, 30, 34)),
}


def any_pen(rng: Rng, hand: HandStyle) -> PenStyle:
    """A random student's pens and way of finishing a drawing."""
    kind = rng.choice(list(PENS), p=[0.24, 0.2, 0.22, 0.1, 0.1, 0.09, 0.05])
    style = PENS[str(kind)]
    free = rng.random() < 0.15
    return replace(
        style,
        line_mm=style.line_mm * float(rng.uniform(0.85, 1.2)),
        wobble_mm=style.wobble_mm * (3.0 if free and hand is SLOPPY else float(rng.uniform(0.7, 1.5))),
        arrow=rng.choice(["open", "filled", "half", "none"], p=[0.4, 0.33, 0.12, 0.15]),
        arrow_mm=float(rng.uniform(2.4, 5.0)),
        overrun_mm=float(rng.choice([0.0, 4.0, 10.0, 20.0])),
        construction_lines=float(rng.choice([0.0, 0.5, 1.0], p=[0.2, 0.4, 0.4])),
        dashed_absolutes=bool(rng.random() < 0.25),
        node_circles=float(rng.choice([0.0, 0.4, 1.0], p=[0.5, 0.3, 0.2])),
        support=rng.choice(["triangle", "arch", "fork"], p=[0.6, 0.25, 0.15]),
        links_stop_short=bool(rng.random() < 0.75),
        plate_hatched=bool(rng.random() < 0.3),
        crank_circle=bool(rng.random() < 0.3),
        erased=float(rng.choice([0.0, 0.15, 0.4])),
        smudges=int(rng.integers(0, 4)),
        doubled=float(rng.choice([0.0, 0.2], p=[0.75, 0.25])),
        arcs=float(rng.choice([0.0, 0.5, 1.0])),
        arrow_half_deg=float(rng.uniform(9.0, 21.0)),
        node_dots=float(rng.choice([0.0, 0.4, 1.0], p=[0.6, 0.2, 0.2])),
    )


def _any_sums(rng: Rng) -> Literal["none", "dashed", "full"]:
    """Return how a random student draws full relative accelerations; one in eight does."""
    return ("none", "dashed", "full")[rng.choice(3, p=[0.875, 0.09, 0.035])]


def any_page(rng: Rng) -> PageStyle:
    """A random page."""
    language = rng.choice(["ro", "ru", "en"], p=[0.5, 0.3, 0.2])
    return PageStyle(
        frame=rng.choice(["iso", "gost", "none"], p=[0.5, 0.35, 0.15]),
        frame_by=rng.choice(["hand", "print"], p=[0.7, 0.3]),
        title_block=rng.choice(["rows", "form", "none"], p=[0.55, 0.3, 0.15]),
        language=language,
        decimal_comma=bool(language != "en" and rng.random() < 0.8),
        captions=bool(rng.random() < 0.75),
        calculations=bool(rng.random() < 0.6),
        scales_written=rng.choice(["title", "captions", "both", "none"], p=[0.4, 0.25, 0.15, 0.2]),
        letter_mm=float(rng.uniform(3.0, 5.5)),
        vector_labels=float(rng.choice([0.0, 0.5, 1.0])),
        end_labels=float(rng.choice([0.0, 0.5, 1.0])),
        bar_over_vectors=bool(rng.random() < 0.2),
        squared_mm=float(rng.choice([0.0, 5.0], p=[0.95, 0.05])),
    )


def any_scan(rng: Rng, device: Device | None = None, dpi: float | None = None) -> Scan:
    """A random scanner, copier or phone with its faults."""
    device = device or rng.choice(["flatbed", "copier", "phone"], p=[0.65, 0.15, 0.2])
    resolution = dpi or float(rng.choice([150.0, 200.0, 300.0, 400.0], p=[0.2, 0.25, 0.45, 0.1]))
    tag = {0: None, 1: 72.0, 2: resolution * 0.5}.get(int(rng.integers(0, 14)), resolution)
    bed: Colour = ((236, 238, 240), (250, 250, 250), (24, 24, 26), (180, 182, 186))[
        rng.choice(4, p=[0.5, 0.25, 0.15, 0.1])
    ]
    tint = rng.uniform(-8, 2, 3) + np.array([244.0, 243.0, 238.0]) - rng.choice([0.0, 14.0], p=[0.8, 0.2])
    common = Scan(
        device=device,
        dpi=resolution,
        quarter_turns=int(rng.choice(4, p=[0.7, 0.08, 0.12, 0.1])),
        skew_deg=float(rng.choice([0.2, 0.6, 1.8])),
        shift_mm=float(rng.choice([0.8, 2.5])),
        stretch=float(rng.choice([0.0003, 0.001])),
        dpi_tag=tag,
        paper=(int(tint[0]), int(tint[1]), int(tint[2])),
        bed=bed,
        jpeg_quality=int(rng.choice([55, 75, 85, 92])),
        blur_px=float(rng.uniform(0.4, 0.9)),
        noise=float(rng.uniform(1.0, 4.0)),
        shading=float(rng.choice([0.0, 0.04, 0.1])),
        dust=int(rng.integers(0, 40)),
        fold=bool(rng.random() < 0.12),
        show_through=float(rng.choice([0.0, 0.06], p=[0.85, 0.15])),
        punched=bool(rng.random() < 0.15),
        mode=rng.choice(["grey", "colour"], p=[0.6, 0.4]),
        container=rng.choice(["jpg", "png", "tif"], p=[0.8, 0.1, 0.1]),
    )
    match device:
        case "copier":
            return _copier(rng, common)
        case "phone":
            return _phone(rng, common)
    return common


def _copier(rng: Rng, scan: Scan) -> Scan:
    return replace(
        scan,
        mode="bilevel",
        container=rng.choice(["tif", "png"]),
        dpi=max(scan.dpi, 200.0),
        copy_scale=float(rng.choice([1.0, 0.98, 0.995, 1.01])),
        dust=scan.dust * 3,
        streaks=int(rng.choice([0, 1, 3], p=[0.7, 0.2, 0.1])),
        dpi_tag=max(scan.dpi, 200.0) if scan.dpi_tag == scan.dpi else scan.dpi_tag,
    )


def _phone(rng: Rng, scan: Scan) -> Scan:
    desk: Colour = ((128, 96, 66), (60, 58, 56), (206, 200, 190), (92, 104, 112))[rng.integers(4)]
    return replace(
        scan,
        mode="colour",
        container="jpg",
        dpi=float(rng.uniform(190.0, 235.0)),
        dpi_tag=72.0,
        bed=desk,
        curl_mm=float(rng.choice([0.0, rng.uniform(0.2, 1.2)], p=[0.8, 0.2])),
        tilt_deg=float(rng.uniform(1.0, 11.0)),
        lens_k1=float(rng.normal(0.0, 0.02)),
        shading=float(rng.uniform(0.1, 0.3)),
        shadow=float(rng.uniform(0.0, 0.35)),
        blur_px=float(rng.uniform(0.6, 1.2)),
        jpeg_quality=int(rng.integers(75, 94)),
        noise=float(rng.uniform(2.0, 5.0)),
        skew_deg=2.0,
    )
