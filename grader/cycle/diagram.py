"""The cycle as a matplotlib diagram: panels of quantities over one axis, paths of points at a round scale.

Needs matplotlib, the extra ``planmark[plots]``.
"""

import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from grader.cycle.quantities import (
    CycleQuantity,
    CycleSubject,
    Selection,
    strokes_of,
    unbounded_ends,
)
from grader.language import N_, Tongue
from reference.authored.assignment import Assignment, Variant
from reference.drawing.canvas import MM_PER_INCH, pieces_of
from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import PointOnLine, SlotPoint
from reference.quantities import KindName

MM = 1.0 / MM_PER_INCH
"""Inches, matplotlib's unit of pages."""
LANDSCAPE_MM, PORTRAIT_MM, WIDE_MM = (297.0, 210.0), (210.0, 297.0), (420.0, 297.0)
PANELS_SHARE = 0.62
"""Width of the panels on a page that has panels and paths."""
PATHS_MM = (22.0, 18.0, 12.0, 34.0)
"""Left, bottom, right, and top margins about the paths, for their numbers and titles."""
PAD_MM = 8.0
"""Room about the paths for the names of points."""
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "mathtext.default": "regular",
    "svg.fonttype": "none",
    "svg.hashsalt": "planmark",
    "pdf.fonttype": 42,
    "lines.linewidth": 1.3,
    "axes.linewidth": 0.7,
    "axes.edgecolor": "#5b6470",
    "axes.axisbelow": True,
    "grid.color": "#dfe3e8",
    "grid.linewidth": 0.4,
    "xtick.color": "#5b6470",
    "ytick.color": "#5b6470",
    "legend.frameon": False,
}
"""Texts stay texts in both formats, names stand upright, and equal input gives equal files."""
COLOURS = ("#0b62a8", "#c8501e", "#11806a", "#8e3b8c", "#b07a00", "#4a4f57", "#d1306e", "#3f8fd0")
DASHES = {"": "-", "x": "--", "y": ":"}
OWN, DEAD, FLAT, END = "#1b1f24", "#7a5c00", "#8e3b8c", "#b42318"
LINK, GREY, SHADE = "#9aa3ad", "#5b6470", "#eceff2"
TITLES: dict[KindName, str] = {
    "velocity": N_("Velocities"),
    "acceleration": N_("Accelerations"),
    "omega": N_("Angular velocities"),
    "epsilon": N_("Angular accelerations"),
}
POSITIONS = 1441
"""Positions drawn, four for each degree of a turn: tips of speeds at dead points look sharp."""
MARGIN = 0.035
"""Share of a limited range shown beyond each of its ends."""
CALM = 0.8
"""Least share of the samples that a panel shows of a quantity that grows without bound."""
SPIKE = 8.0
"""A value this many times larger than the calm ones is outside the panel as well."""
SAME = 1e-3
"""Degrees or millimetres: dead points closer than this have one mark."""
SCALES = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Round scales of the paths, times a power of ten."""


Box = tuple[float, float, float, float]
"""Left, bottom, right, top."""


@dataclass(frozen=True, slots=True)
class CycleMark:
    """A line through all panels at a driving coordinate (degrees or mm), with a text above it."""

    at: float
    text: str
    colour: str
    dash: str


@dataclass(frozen=True, slots=True)
class Setting:
    """The variant whose cycle is drawn, and the language of the texts."""

    assignment: Assignment
    variant: Variant
    words: Tongue

    @property
    def title(self) -> str:
        """The assignment's title and id, the variant's number and position."""
        parts = [f"{self.words.gettext(name)} = {value}" for name, value in self.variant.numbers.items()]
        title = self.assignment.file.title.in_language(self.words.lang)
        return ", ".join([f"{title} ({self.assignment.id})", *parts])

    def shown(self, name: str) -> str:
        """Return a quantity's name as students see it."""
        return mathtext(self.assignment.file.names.get(name, name))


def mathtext(name: str) -> str:
    """Return a name with its indices in matplotlib's notation: ``v_BA`` is v with BA below it.

    Characters that the notation cannot write are replaced by similar ones.
    """
    plain = name.translate(str.maketrans("^#\\ ", "ˆ№/\N{NO-BREAK SPACE}"))
    marks = {0: "{%s}", -1: r"_{%s}", 1: r"^{%s}"}
    escaped = ((re.sub(r"([${}%_])", r"\\\1", piece.text), piece.height) for piece in pieces_of(plain))
    return "$" + "".join(marks[height] % text for text, height in escaped) + "$"


def cycle_diagram(
    subject: CycleSubject, selection: Selection, setting: Setting, formats: Sequence[str]
) -> list[bytes]:
    """Return the diagram as files of some formats: ``svg``, ``pdf``, ``png``."""
    files = []
    with mpl.rc_context(STYLE):
        figure = cycle_figure(subject, selection, setting)
        for kind in formats:
            buffer = io.BytesIO()
            undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
            figure.savefig(buffer, format=kind, metadata={"Title": setting.title, **undated})
            files.append(buffer.getvalue())
    return files


def cycle_figure(subject: CycleSubject, selection: Selection, setting: Setting) -> Figure:
    """Return the page: a panel for each kind of quantity, and the paths beside them."""
    kinds = [kind for kind in TITLES if any(quantity.kind == kind for quantity in selection.quantities)]
    size = WIDE_MM if kinds and selection.points else LANDSCAPE_MM if len(kinds) <= 2 else PORTRAIT_MM
    figure = Figure(figsize=(size[0] * MM, size[1] * MM))
    figure.text(0.03, 1.0 - 10.0 / size[1], setting.title, fontsize=13)
    figure.text(0.03, 1.0 - 16.0 / size[1], _speed(subject, setting.words), color=GREY, fontsize=9.5)
    owners = dict.fromkeys(_owner(quantity) for quantity in selection.quantities)
    owners |= dict.fromkeys(selection.points)
    colours = {owner: COLOURS[k % len(COLOURS)] for k, owner in enumerate(owners)}
    start = 0.0
    if kinds:
        start = PANELS_SHARE if selection.points else 0.96
        figure.set_layout_engine("constrained", rect=(0.02, 0.02, start, 1.0 - 24.0 / size[1]))
        _panels(figure, subject, selection.quantities, kinds, setting, colours)
    if selection.points:
        room = (start * size[0] + PATHS_MM[0], PATHS_MM[1], size[0] - PATHS_MM[2], size[1] - PATHS_MM[3])
        _paths(figure, subject, {point: colours[point] for point in selection.points}, setting.words, room)
    return figure


def _owner(quantity: CycleQuantity) -> str:
    """Return the point, pair of points or link of a quantity: it has one colour in all panels."""
    return quantity.of.partition("_")[2]


def _speed(subject: CycleSubject, words: Tongue) -> str:
    """Return the speed and the acceleration of the driving link."""
    driver = subject.structure.driver
    if subject.cycle.is_turned:
        rates = (("omega", "omega", "rad/s"), ("epsilon", "epsilon", "rad/s²"))
    else:
        rates = (("v", "speed", "m/s"), ("a", "acceleration", "m/s²"))
    link = driver.link if subject.cycle.is_turned else driver.pin
    texts = []
    for (letter, name, unit), is_optional in zip(rates, (False, True), strict=True):
        value = float(getattr(driver, name)[0])
        if value or not is_optional:
            texts.append(f"{mathtext(f'{letter}_{link}')} = {words.value(value, unit)}")
    return ",  ".join(texts)


def _panels(
    figure: Figure,
    subject: CycleSubject,
    quantities: Sequence[CycleQuantity],
    kinds: Sequence[KindName],
    setting: Setting,
    colours: Mapping[str, str],
) -> None:
    """Draw the panels one below another; the marks pass through all of them, their texts stand above."""
    words, cycle = setting.words, subject.cycle
    all_axes = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    ends = _as_read(subject, cycle.driving[[0, -1]])
    margin = 0.0 if cycle.turns else MARGIN * float(np.ptp(ends))
    all_axes[0].set_xlim(ends[0] - margin, ends[1] + margin)
    steps = [1, 1.5, 3, 4.5, 9, 10] if cycle.is_turned else [1, 2, 2.5, 5, 10]
    all_axes[-1].xaxis.set_major_locator(MaxNLocator(13, steps=steps))
    _number_ticks(all_axes[-1].xaxis, words)
    title = words.gettext("crank angle, °") if cycle.is_turned else words.gettext("displacement, mm")
    all_axes[-1].set_xlabel(title, loc="right")
    marks = list(marks_of(subject, words))
    for axes, kind in zip(all_axes, kinds, strict=True):
        _panel(
            axes, subject, [quantity for quantity in quantities if quantity.kind == kind], setting, colours
        )
        for low, high in ((ends[0] - margin, ends[0]), (ends[1], ends[1] + margin)):
            if margin:
                axes.axvspan(low, high, color=SHADE, zorder=0, linewidth=0)
        for mark in marks:
            axes.axvline(mark.at, color=mark.colour, linestyle=mark.dash, linewidth=0.8, zorder=1.5)
    _write_marks(all_axes[0], marks)


def _panel(
    axes: Axes,
    subject: CycleSubject,
    quantities: Sequence[CycleQuantity],
    setting: Setting,
    colours: Mapping[str, str],
) -> None:
    """Draw curves of quantities of one kind with a legend; a ring marks the variant's own position."""
    words, kind = setting.words, quantities[0].kind
    start = np.array([subject.cycle.start])
    driving = np.linspace(subject.cycle.driving[0], subject.cycle.driving[-1], POSITIONS)
    driving = driving if subject.cycle.turns else driving[1:-1]
    motion = subject.motion_at(driving)
    bounds = [(0.0, 0.0)]
    for quantity in quantities:
        values, own = subject.values(quantity, motion), subject.values_at(quantity, start)
        defined = np.isfinite(values)
        if not defined.any():
            continue
        colour = colours[_owner(quantity)]
        axes.plot(
            _as_read(subject, driving[defined]),
            values[defined],
            color=colour,
            linestyle=DASHES[quantity.axis],
            label=setting.shown(quantity.name),
        )
        axes.plot(_as_read(subject, start), own, "o", mfc="white", mec=colour, ms=4.5, mew=1.0)
        bounds.append(_heights(subject, quantity, values[defined], float(own[0])))
    low, high = min(low for low, _ in bounds), max(high for _, high in bounds)
    room = 0.04 * (high - low or 1.0)
    axes.set_ylim(low - room if low < 0.0 else 0.0, high + room)
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    power = _number_ticks(axes.yaxis, words)
    unit = words.unit(quantities[0].unit)
    axes.set_ylabel(f"{words.gettext(TITLES[kind])},\n" + (f"$10^{{{power}}}$ {unit}" if power else unit))
    if low < 0.0:
        axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1.5)
    axes.grid(visible=True)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=10, handlelength=1.8)


def _heights(
    subject: CycleSubject, quantity: CycleQuantity, values: FloatArray, own: float
) -> tuple[float, float]:
    """Return the smallest and largest value to show; if unbounded, of the calm part and the own position."""
    least, most = float(values.min()), float(values.max())
    size = np.abs(values)
    humps = size[1:-1][(size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])]
    calm = max(float(np.quantile(size, CALM)), abs(own) if math.isfinite(own) else 0.0)
    limit = 1.15 * max([calm, *(hump for hump in humps if hump < SPIKE * calm)])
    if any(unbounded_ends(subject, quantity)) or max(-least, most) > SPIKE * limit:
        return max(least, -limit), min(most, limit)
    return least, most


def _number_ticks(axis: Any, words: Tongue) -> int:  # noqa: ANN401 - matplotlib's axes have no common type
    """Write numbers in the language; return the power of ten left to the unit."""
    ticks = axis.get_majorticklocs()
    largest = max(map(abs, axis.get_view_interval()))
    power = 0 if 0.1 <= largest < 1e5 else 3 * math.floor(math.log10(largest) / 3.0)
    step = float(ticks[1] - ticks[0]) / 10.0**power
    digits = next(digits for digits in range(16) if math.isclose(round(step, digits), step, rel_tol=1e-6))
    axis.set_major_formatter(FuncFormatter(lambda value, _: words.number(value / 10.0**power, digits)))
    return power


def _write_marks(axes: Axes, marks: Sequence[CycleMark]) -> None:
    """Write the texts of the marks above a panel, each in the lowest row that has room for it."""
    left, right = axes.get_xlim()
    figure = cast("Figure", axes.figure)
    figure.draw_without_rendering()
    rows: list[float] = []
    for mark in sorted((mark for mark in marks if mark.text), key=lambda mark: mark.at):
        share = (mark.at - left) / (right - left)
        # A text near an end of the axis reaches inwards from its line.
        side, start = ("left", 0.0) if share < 0.1 else ("right", 1.0) if share > 0.9 else ("center", 0.5)
        text = axes.annotate(
            mark.text, (mark.at, 1.0), (0.0, 6.0), xycoords=axes.get_xaxis_transform(), ha=side,
            textcoords="offset points", color=mark.colour, bbox={"fc": "white", "ec": "none", "pad": 0.8},
            arrowprops={"arrowstyle": "-", "color": mark.colour, "lw": 0.8, "shrinkA": 0, "shrinkB": 0,
                        "relpos": (start, 0.0)},
        )  # fmt: skip
        box = text.get_window_extent()
        row = next((k for k, end in enumerate(rows) if end < box.x0), len(rows))
        rows[row : row + 1] = [box.x1 + 0.5 * box.height]
        text.xyann = (0.0, 6.0 + 11.0 * row)


def marks_of(subject: CycleSubject, words: Tongue) -> Iterator[CycleMark]:
    """Yield the variant's own position, dead points, flat positions and the ends of the range."""
    cycle = subject.cycle
    letter, own = "φ" if cycle.is_turned else "s", words.gettext("this variant")
    yield _mark(subject, cycle.start, f"{own}: {letter} = {_driving(subject, cycle.start, words)}", OWN, "-.")
    for title, colour, dash, places in (
        (words.gettext("dead point"), DEAD, "--", _dead_points(subject, words)),
        (words.gettext("flat position"), FLAT, ":", [(event.at, event.node) for event in cycle.passed]),
    ):
        for at, names in places:
            yield _mark(subject, at, f"{title} ({names}): {_driving(subject, at, words)}", colour, dash)
            if cycle.turns and _as_read(subject, at) < SAME:
                yield _mark(subject, float(cycle.driving[-1]), "", colour, dash)
    for stop in () if cycle.turns else cycle.following.stops:
        if stop is not None:
            text = f"{_driving(subject, stop.at, words)}, {stop.node}: {words.gettext(stop.why)}"
            yield _mark(subject, stop.at, text, END, "-")


def _mark(subject: CycleSubject, driving: float, text: str, colour: str, dash: str) -> CycleMark:
    return CycleMark(float(_as_read(subject, driving)), text, colour, dash)


def _dead_points(subject: CycleSubject, words: Tongue) -> list[tuple[float, str]]:
    """Return the dead points, each with the names of everything at rest there."""
    dead: dict[float, list[str]] = {}
    for stroke in strokes_of(subject):
        name = words.gettext("link %(name)s") % {"name": stroke.name} if stroke.is_angle else stroke.name
        for at in stroke.dead_points:
            place = next((known for known in dead if abs(_as_read(subject, known - at)) < SAME), at)
            dead.setdefault(place, []).append(name)
    return [(at, ", ".join(names)) for at, names in dead.items()]


def _as_read(subject: CycleSubject, driving: float | FloatArray) -> FloatArray:
    """Return driving coordinates in degrees or millimetres."""
    return np.asarray(np.degrees(driving) if subject.cycle.is_turned else 1e3 * np.asarray(driving))


def _driving(subject: CycleSubject, driving: float, words: Tongue) -> str:
    """Write a driving coordinate with its unit."""
    if subject.cycle.is_turned:
        return f"{words.trimmed(float(np.degrees(driving)), 2)}°"
    return words.quantity(1e3 * driving, 2, "mm")


def _paths(
    figure: Figure, subject: CycleSubject, colours: Mapping[str, str], words: Tongue, room_mm: Box
) -> None:
    """Draw paths of some points at the largest round scale, and the mechanism in this variant's position."""
    cycle = subject.cycle
    here = subject.motion_at(np.array([cycle.start]))
    joints = {joint: complex(np.broadcast_to(at, (1,))[0]) for joint, at in here.position.items()}
    paths = {p: np.array(np.broadcast_to(cycle.motion.position[p], cycle.driving.shape)) for p in colours}
    every = np.concatenate([*paths.values(), np.array(list(joints.values()))])
    axes, scale, unit, factor = _path_axes(figure, every[np.isfinite(every)], room_mm)
    links = _links(subject)
    for first, second in links:
        ends = np.array([joints[first], joints[second]]) * factor
        axes.plot(ends.real, ends.imag, color=LINK)
    for point, path in paths.items():
        drawn = path[np.isfinite(path)] * factor
        axes.plot(drawn.real, drawn.imag, color=colours[point])
        if cycle.is_turned:
            dots = _at_round_angles(subject, point) * factor
            axes.plot(dots.real, dots.imag, ".", color=colours[point], ms=4.5)
    for joint, at in joints.items():
        is_ground, colour = subject.structure.is_ground(joint), colours.get(joint, GREY)
        axes.plot(at.real * factor, at.imag * factor, "o", mfc="white", mec=colour, ms=6 if is_ground else 4)
        if is_ground or joint in colours:
            lines = [joints[b if a == joint else a] - at for a, b in links if joint in {a, b}]
            if joint in colours:
                tangent = complex(here.velocity[joint][0])
                lines += [tangent, -tangent]
            free = _free_direction(lines)
            axes.annotate(
                mathtext(joint), (at.real * factor, at.imag * factor), (11.0 * free.real, 11.0 * free.imag),
                textcoords="offset points", color=colour, fontsize=10, ha="center", va="center",
            )  # fmt: skip
    for axis in (axes.xaxis, axes.yaxis):
        _number_ticks(axis, words)
    ratio = f"1 : {words.trimmed(scale, 1)}" if scale >= 1.0 else f"{words.trimmed(1.0 / scale, 1)} : 1"
    title = words.gettext("Paths of points")
    axes.set_title(f"{title}, {ratio}", loc="left", fontsize="medium")
    axes.set_xlabel(f"x, y, {words.unit(unit)}", loc="right")
    axes.grid(visible=True)
    if cycle.is_turned:
        axes.annotate(
            words.gettext("a dot every 30° of the crank"), (0.0, 0.0), (0.0, -26.0), xycoords="axes fraction",
            textcoords="offset points", color=GREY,
        )  # fmt: skip


def _free_direction(lines: Sequence[complex]) -> complex:
    """Return the direction, of eight, farthest from all lines at a point."""
    ways = np.exp(0.25j * np.pi * np.arange(8))
    gaps = [min((abs(float(np.angle(way / line))) for line in lines if line), default=0.0) for way in ways]
    return complex(ways[int(np.argmax(gaps))])


def _path_axes(figure: Figure, places: ComplexArray, room_mm: Box) -> tuple[Axes, float, str, float]:
    """Return axes about some points; metres per metre on paper; the unit of numbers, and units per metre."""
    left, bottom, right, top = room_mm
    x, y = (np.array([side.min(), side.max()]) for side in (places.real, places.imag))
    sides = (right - left - 2.0 * PAD_MM, top - bottom - 2.0 * PAD_MM)
    least = 1e3 * max(np.ptp(x) / sides[0], np.ptp(y) / sides[1])
    power = 10.0 ** math.floor(math.log10(least)) if least > 0.0 else 1.0
    scale = next(part * power for part in SCALES if part * power >= least)
    pad = np.array([-1e-3, 1e-3]) * PAD_MM * scale
    across, up = (1e3 * float(np.ptp(side + pad)) / scale for side in (x, y))
    width, height = figure.get_size_inches() / MM
    axes = figure.add_axes((left / width, (top - up) / height, across / width, up / height))
    unit, factor = ("m", 1.0) if np.abs([*(x + pad), *(y + pad)]).max() >= 2.0 else ("mm", 1e3)
    axes.set(xlim=(x + pad) * factor, ylim=(y + pad) * factor)
    locator = MaxNLocator(max(2, int(across / 13.0)), steps=[1, 2, 2.5, 5, 10])
    step = np.diff(locator.tick_values(*axes.get_xlim()))[0]
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    return axes, scale, unit, factor


def _at_round_angles(subject: CycleSubject, point: str) -> ComplexArray:
    """Return a point's positions at every 30 degrees of the crank."""
    low, high = np.degrees(subject.cycle.driving[[0, -1]])
    first, last = math.ceil(low / 30.0 - 1e-9), math.floor(high / 30.0 + 1e-9)
    angles = np.radians(30.0 * np.arange(first, last + (0 if subject.cycle.turns else 1)))
    places = subject.motion_at(angles).position[point]
    return np.asarray(places[np.isfinite(places)])


def _links(subject: CycleSubject) -> list[tuple[str, str]]:
    """Return pairs of joints that a rigid link holds at a fixed distance, drawn as lines."""
    pairs = list(subject.construction.links.values())
    for group in subject.structure.groups:
        match group:
            case PointOnLine(node=node, base=ends):
                pairs += [(end, node) for end in ends]
            case SlotPoint(node=node, slotted=end):
                pairs.append((end, node))
            case _:
                pass
    return pairs
