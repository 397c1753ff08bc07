"""Texts that students write: captions, title block, scales, calculations, in three languages."""

from collections.abc import Mapping

import numpy as np

from reference.mechanism import Crank
from samples.simulation.hand import DrawingTask
from samples.simulation.settings import ACCELERATION, FORCES, MECHANISM, VELOCITY, PageStyle
from samples.simulation.strokes import Rng

CAPTIONS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "ro": {
        MECHANISM: ("Schema cinematică", "Schema mecanismului", "Mecanismul"),
        VELOCITY: ("Planul vitezelor", "Poligonul vitezelor", "Viteze"),
        ACCELERATION: ("Planul accelerațiilor", "Poligonul accelerațiilor", "Accelerații"),
        FORCES: ("Planul forțelor", "Poligonul forțelor", "Forțe"),
    },
    "ru": {
        MECHANISM: ("Схема механизма", "План положения", "Механизм"),
        VELOCITY: ("План скоростей", "Скорости"),
        ACCELERATION: ("План ускорений", "Ускорения"),
        FORCES: ("План сил", "Силы"),
    },
    "en": {
        MECHANISM: ("Mechanism", "Space diagram", "Position diagram"),
        VELOCITY: ("Velocity plan", "Velocity diagram"),
        ACCELERATION: ("Acceleration plan", "Acceleration diagram"),
        FORCES: ("Force plan", "Force polygon", "Forces"),
    },
}
WORDS: Mapping[str, Mapping[str, str]] = {
    "ro": {"name": "Nume", "group": "Grupa", "sheet": "Planșa", "number": "Nr.", "date": "Data"},
    "ru": {"name": "Студент", "group": "Группа", "sheet": "Лист", "number": "Вариант", "date": "Дата"},
    "en": {"name": "Name", "group": "Group", "sheet": "Sheet", "number": "No.", "date": "Date"},
}
SCALES = ("kL", "kv", "ka", "kF")
UNITS: Mapping[str, tuple[str, ...]] = {
    "ro": ("m/mm", "(m/s)/mm", "(m/s^2)/mm", "N/mm"),
    "ru": ("м/мм", "(м/с)/мм", "(м/с^2)/мм", "Н/мм"),
    "en": ("m/mm", "(m/s)/mm", "(m/s^2)/mm", "N/mm"),
}
SCALE_UNITS: Mapping[str, str] = dict(zip(SCALES, UNITS["en"], strict=True))
"""As they are entered in rosters and tables of measurements."""
_SCALE_OF = {MECHANISM: "kL", VELOCITY: "kv", ACCELERATION: "ka", FORCES: "kF"}


def number(value: float, page: PageStyle, digits: int = 4) -> str:
    """A number as people write it: a few significant digits, a comma or a point."""
    text = f"{float(f'{value:.{digits}g}'):f}".rstrip("0").rstrip(".")
    return text.replace(".", ",") if page.decimal_comma else text


def declared_texts(scales: Mapping[str, float]) -> dict[str, str]:
    """Scales as they are entered, with all digits."""
    return {name: f"{value!r} {SCALE_UNITS[name]}" for name, value in scales.items()}


def scale_text(name: str, value: float, task: DrawingTask, page: PageStyle, rng: Rng) -> str:
    """A declared scale as written on the sheet."""
    known = task.assignment.file.names.get(name, name)
    symbol = f"{known[0]}_{known[1:]}"
    ratio = 1.0 / (value * 1000.0)
    if name == "kL" and rng.random() < 0.3 and abs(1 / ratio - round(1 / ratio)) < 1e-6:
        return f"{symbol} = 1:{round(1 / ratio)}"
    unit = UNITS[page.language][SCALES.index(name)]
    if rng.random() < 0.3:
        unit = unit.replace(")/", "·").replace("(", "")
    return f"{symbol} = {number(value, page)} {unit}"


def caption(figure: str, task: DrawingTask, page: PageStyle, rng: Rng, written: dict[str, str]) -> list[str]:
    """The lines written above a figure; adds the scales in them to `written`."""
    sort = FORCES if figure.startswith(FORCES) else figure
    choices = CAPTIONS[page.language][sort]
    lines = [choices[rng.integers(len(choices))]] if page.captions else []
    if page.scales_written in {"captions", "both"}:
        name = _SCALE_OF[sort]
        text = scale_text(name, task.declared[name], task, page, rng)
        written[name] = plain(text)
        lines.append(text)
    return lines


def title_rows(task: DrawingTask, page: PageStyle, rng: Rng, written: dict[str, str]) -> list[list[str]]:
    """The cells of the title block, row by row; adds the scales in them to `written`."""
    words = WORDS[page.language]
    who = task.variant.n if task.variant.n is not None else task.variant.position
    title = task.assignment.file.title
    name = title.in_language(page.language)
    rows = [[name], [f"{words['number']} {who}"]]
    if page.scales_written in {"title", "both"}:
        scales = {n: scale_text(n, task.declared[n], task, page, rng) for n in task.declared}
        written.update({n: plain(text) for n, text in scales.items()})
        rows.append(list(scales.values())[:2])
        rows.append(list(scales.values())[2:] or [""])
    else:
        rows.append([f"{words['group']} {rng.choice(['ME-213', 'TM-31', 'M2-04', '402'])}"])
    if rng.random() < 0.5:
        rows.append([f"{words['date']} {rng.integers(1, 29)}.{rng.integers(1, 13):02d}.2025"])
    return rows


def plain(text: str) -> str:
    """A text without its markup."""
    return text.replace("_", "").replace("^2", "²").replace("^", "")


def calculations(task: DrawingTask, page: PageStyle, nodes: Mapping[str, complex]) -> list[str]:
    """A few lines of calculations, with this student's own numbers."""
    known, crank = task.wrong.parameters, task.mechanism.driver
    lines = []
    if isinstance(crank, Crank):
        arm = float(np.mean(crank.length_m))
        speed = abs(float(known[f"v_{crank.pin}"]))
        pull = abs(float(known[f"a_{crank.pin}_n"]))
        lines = [
            f"ω_1 = π n/30 = {number(speed / arm, page)} s^{{-1}}",
            f"v_{crank.pin} = ω_1·l = {number(speed, page)} m/s",
            f"a_{crank.pin} = ω_1^2·l = {number(pull, page)} m/s^2",
        ]
    for vector in task.wrong.construction.vectors_of(VELOCITY):
        if vector.head in nodes and vector.tail in nodes:
            length = abs(nodes[vector.head] - nodes[vector.tail])
            value = length * task.used["kv"]
            about = vector.name.split("_", 1)[1]
            drawn, scale = number(round(length * 2) / 2, page), number(task.used["kv"], page, 3)
            lines.append(f"v_{{{about}}} = {drawn}·{scale} = {number(value, page, 3)} m/s")
    return lines
