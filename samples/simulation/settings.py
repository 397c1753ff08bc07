"""Settings of a simulated student, pen and scanner."""

from dataclasses import dataclass, field
from typing import Literal

Colour = tuple[int, int, int]
Box = tuple[float, float, float, float]
"""Left, top, width and height, sheet millimetres, y down."""
Habit = Literal[
    "erased", "struck", "long helpers", "dimensions", "hatched sections", "third figure", "overlapping"
]
"""An extra that a person leaves on a sheet beside the drawing (`samples.simulation.habits`)."""
MECHANISM, VELOCITY, ACCELERATION = "mechanism", "velocity_plan", "acceleration_plan"
PLANS = (VELOCITY, ACCELERATION)
FORCES = "force_plan_"
"""The figures of a drawing, by the names of the published formats; `FORCES` starts those of polygons."""


@dataclass(frozen=True, slots=True)
class HandStyle:
    """The size of one person's slips (`samples.simulation.instruments`); they propagate.

    Attributes
    ----------
    edge_mm : slip of a ruler's edge beside each point that it should pass through
    square_deg : slip of a set square for every 100 mm that a direction is carried, and of a protractor
    reading_mm : slip of a length set on or read off a scale
    graduation_mm : step to which lengths are read, 0 for exactly
    mark_mm : slip of a pencil's dot or a needle's prick, along x and along y
    redraw_mm : slip of a stroke's end about the node that it joins
    """

    edge_mm: float = 0.15
    square_deg: float = 0.15
    reading_mm: float = 0.15
    graduation_mm: float = 0.5
    mark_mm: float = 0.1
    redraw_mm: float = 0.15


PERFECT = HandStyle(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
CAREFUL = HandStyle(0.08, 0.06, 0.08, 0.5, 0.05, 0.08)
TYPICAL = HandStyle()
SLOPPY = HandStyle(0.4, 0.45, 0.4, 1.0, 0.2, 0.35)
"""Plotting on paper is good to 0.1 to 0.4 mm, usually to 0.25: between a careful and a typical hand's."""


@dataclass(frozen=True, slots=True)
class Student:
    """One student's choices and habits.

    Attributes
    ----------
    crank_mm : drawn length of the crank; None as the assignment proposes
    shrunk : size of a sketch without a crank, as a multiple of the proposed one
    kv_ratio, ka_ratio : scales used, as a multiple of the assignment's rule
    similarity : third points of plates by similar triangles; None as the assignment says
    turn_deg : how far the sketch of the mechanism is turned
    mistakes : codes of mistakes to make, each at a random step among those that admit it
    sheets : 1 for all figures on one sheet, 2 for velocities and accelerations apart
    vectors_on_mechanism : v_A and a_A drawn at the crank's pin as well
    from_plans : a_D drawn at D, and the acceleration poles of links
    altitude : right-triangle construction of a normal component on the mechanism; with `every_altitude` of
        each one, at any scales
    omitted : share of the pole-to-point vectors that are not drawn out
    abandoned : a figure begun and crossed out; with `abandoned_whole` drawn to its end before
    helpers : thin lines of no meaning: directions carried over from the sketch, rulers set wrongly
    habits : other extras on a plain sheet; ``overlapping`` figures lie on each other
    force_order : in which forces are laid off (`samples.simulation.forces.HABITS`)
    whole_reactions : how the sums of two parts of a reaction are drawn
    force_names : share of forces with their names beside them
    arrows_in_middle : arrowheads of forces in the middle, not at the end
    largest_force_mm : about how long the largest force is drawn, where the student chooses kF
    """

    crank_mm: float | None = None
    shrunk: float = 1.0
    kv_ratio: float = 1.0
    ka_ratio: float = 1.0
    similarity: bool | None = None
    turn_deg: float = 0.0
    mistakes: tuple[str, ...] = ()
    sheets: Literal[1, 2] = 1
    vectors_on_mechanism: bool = False
    from_plans: bool = False
    altitude: bool = False
    every_altitude: bool = False
    omitted: float = 0.0
    abandoned: bool = False
    abandoned_whole: bool = False
    helpers: int = 0
    habits: tuple[Habit, ...] = ()
    force_order: str = "usual"
    whole_reactions: Literal["none", "dashed", "full"] = "dashed"
    force_names: float = 0.9
    arrows_in_middle: bool = False
    largest_force_mm: float = 100.0


@dataclass(frozen=True, slots=True)
class PenStyle:
    """Pens and how the drawing is finished.

    Attributes
    ----------
    line_mm, thin_mm : mean width of finished and of construction lines
    dark, thin_dark : share of light that they take
    pressure, wobble_mm, grain : unevenness along a stroke, across it, and of its surface
    plan_colour : colour for vectors, None for the same pen
    overrun_mm : mean length by which construction lines run past the points they gave
    arrow_half_deg : mean angle between an arrowhead's barb and the vector
    construction_lines, node_circles, node_dots, erased, doubled, arcs : probability of drawing each
        such thing
    construction_dashed : share of construction lines that are dashed or chain lines
    ghost_dark : share of light that a badly erased line still takes
    smear : soft lead rubbed along by the hand: share of light beside strokes, 0 for none
    dashed_absolutes : vectors that only join two known points are dashed
    sums : how full relative accelerations, such as a_BA, are drawn
    """

    line_mm: float = 0.5
    thin_mm: float = 0.25
    dark: float = 0.75
    thin_dark: float = 0.4
    pressure: float = 0.12
    wobble_mm: float = 0.04
    grain: float = 0.35
    colour: Colour = (70, 70, 74)
    plan_colour: Colour | None = None
    arrow: Literal["open", "filled", "half", "closed", "none"] = "open"
    arrow_mm: float = 3.5
    arrow_half_deg: float = 13.0
    overrun_mm: float = 8.0
    construction_lines: float = 0.7
    dashed_absolutes: bool = False
    sums: Literal["none", "dashed", "full"] = "none"
    node_circles: float = 0.3
    node_dots: float = 0.0
    support: Literal["triangle", "arch", "fork"] = "triangle"
    links_stop_short: bool = True
    plate_hatched: bool = False
    crank_circle: bool = False
    erased: float = 0.1
    smudges: int = 1
    doubled: float = 0.0
    arcs: float = 0.4
    construction_dashed: float = 0.0
    ghost_dark: float = 0.1
    smear: float = 0.0


@dataclass(frozen=True, slots=True)
class PageStyle:
    """The page: frame, title block, language, what is written.

    `squared_mm` is the pitch of paper with printed squares, 0 for plain paper, every fifth line of
    millimetre paper stronger, in the colour `squares`, of which its lines of `squares_width_mm` take the
    share `squares_dark`; `squares_turn_deg` and `squares_bent_mm` say how far they are turned and bent
    against the sheet, `squares_broken` how unevenly they are printed; `letters_touch` the share of letters
    set down without a look at what is there, on lines and other letters.
    """

    frame: Literal["iso", "gost", "none"] = "iso"
    frame_by: Literal["hand", "print"] = "hand"
    title_block: Literal["rows", "form", "none"] = "rows"
    language: Literal["en", "ro", "ru"] = "ro"
    decimal_comma: bool = True
    captions: bool = True
    calculations: bool = True
    scales_written: Literal["title", "captions", "both", "none"] = "title"
    letter_mm: float = 4.0
    vector_labels: float = 0.6
    end_labels: float = 0.3
    bar_over_vectors: bool = False
    squared_mm: float = 0.0
    squares: Colour = (150, 190, 225)
    squares_width_mm: float = 0.12
    squares_dark: float = 0.6
    squares_turn_deg: float = 0.0
    squares_bent_mm: float = 0.0
    squares_broken: float = 0.0
    letters_touch: float = 0.0


@dataclass(frozen=True, slots=True)
class Scan:
    """The scanner, copier or phone that turns the sheet into a file.

    Attributes
    ----------
    device : ``flatbed``, ``copier`` (one bit) or ``phone``
    dpi : resolution; for a phone the average
    quarter_turns : how often the stored image is turned counter-clockwise
    skew_deg, shift_mm : standard deviations of the sheet's angle and position
    stretch : standard deviation of the relative scale errors of x and y
    copy_scale : a copier's enlargement of the drawing
    dpi_tag : resolution stated in the file; None for none
    jpeg_tables : the coarse tables of a program that saves for the web, in place of the quality
    streaks : faint lines along the whole image from dirt on the glass
    crease : how sharp a fold is, 1 for a usual one
    stains : rings and drops of coffee
    sharpen : a scanner's unsharp mask, the share of an edge that is added to it
    dithered : one bit by error diffusion, not by a threshold
    curl_mm : how far a photographed sheet's bow moves its middle against a flat one
    levels : brightness that an office scanner maps to black, and to white: faint ink turns into paper
    cropped_mm : how much its automatic cropping takes off each edge, on average
    """

    device: Literal["flatbed", "copier", "phone"] = "flatbed"
    dpi: float = 300.0
    mode: Literal["grey", "colour", "bilevel"] = "grey"
    container: Literal["jpg", "png", "tif", "pdf"] = "jpg"
    quarter_turns: int = 0
    skew_deg: float = 0.4
    shift_mm: float = 1.5
    stretch: float = 0.0006
    copy_scale: float = 1.0
    dpi_tag: float | None = 300.0
    jpeg_quality: int = 85
    jpeg_tables: Literal["", "web_low"] = ""
    blur_px: float = 0.55
    sharpen: float = 0.0
    dithered: bool = False
    noise: float = 2.0
    shading: float = 0.04
    paper: Colour = (246, 246, 242)
    tint_grain: float = 1.5
    bed: Colour = (236, 238, 240)
    dust: int = 12
    streaks: int = 0
    fold: bool = False
    crease: float = 1.0
    stains: int = 0
    show_through: float = 0.0
    punched: bool = False
    lens_k1: float = 0.0
    tilt_deg: float = 0.0
    curl_mm: float = 0.0
    levels: tuple[float, float] = (0.0, 255.0)
    cropped_mm: float = 0.0
    shadow: float = 0.0


@dataclass(frozen=True, slots=True)
class Settings:
    """All settings of one student's work; the rest is random, by the seed."""

    hand: HandStyle = TYPICAL
    student: Student = field(default_factory=Student)
    pen: PenStyle = field(default_factory=PenStyle)
    page: PageStyle = field(default_factory=PageStyle)
    scan: Scan = field(default_factory=Scan)


CLEAN_SCAN = Scan(
    skew_deg=0.0,
    shift_mm=0.0,
    stretch=0.0,
    noise=0.0,
    shading=0.0,
    tint_grain=0.0,
    dust=0,
    blur_px=0.0,
    jpeg_quality=98,
)
"""A scanner without faults."""
