"""The sets of data that a drawing may follow, and the exact drawings for them.

The student's own (also in another assembly, and with each single mistake), every other variant's, and the own
data with a misread crank angle. Exact drawings are arrays over the sets.
"""

import cmath
import functools
import math
import operator
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, combinations
from typing import Literal

import numpy as np

from grader.comparison.evidence import DrawnVector
from grader.comparison.task import Task
from grader.records import MECHANISM
from reference.authored.assignment import SCALE_NAMES, Assignment, Scales, Variant
from reference.construction.elements import Nodes, Parameters, View
from reference.construction.graph import Construction, evaluate
from reference.construction.mistakes import (
    Drawing,
    Mistake,
    changed_step,
    rarer_mistakes_of_step,
    single_mistakes,
)
from reference.construction.steps import ArcAndLine, TwoArcs
from reference.errors import PlanmarkError
from reference.geometry import ComplexArray, FloatArray
from reference.plan import parameters_for
from reference.quantities import OF_MOTION

Kind = Literal["own", "other_variant", "data_misread"]
CRANK = "angle crank"
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
DrawnParts = Mapping[str, Mapping[str, DrawnVector]]
"""Drawn vectors, by part (mechanism or plan) and name."""
MISREADINGS: Mapping[str, tuple[int, float]] = {
    "clockwise": (-1, 0.0),
    "supplement": (-1, 180.0),
    "opposite": (1, 180.0),
    "from_other_axis": (-1, 90.0),
    "quarter_ahead": (1, 90.0),
    "quarter_behind": (1, -90.0),
}
"""Ways of misreading a crank angle: the factor of the angle given, and the angle added, degrees."""
ELSEWHERE = "elsewhere"
"""The crank at an angle that is none of these; the angle is taken from the drawing."""


@dataclass(frozen=True, slots=True)
class Data:
    """A set of data that a drawing may follow.

    Attributes
    ----------
    kind : the student's own (also in another assembly, or with a mistake), another variant's, or misread ones
    variant : the variant that the data belong to
    how : of misread data one of `MISREADINGS`, or `ELSEWHERE`
    parameters : the construction's, SI, without scales
    rule : the scales by the assignment's rule
    """

    kind: Kind
    variant: Variant
    how: str = ""
    parameters: Parameters = field(default_factory=dict, repr=False, compare=False)
    rule: Mapping[str, float] = field(default_factory=dict, repr=False, compare=False)


# The sets of data ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ExactDrawings:
    """Exact drawings by many sets of data: complex SI, arrays (sets,) by vector and by link."""

    data: tuple[Data, ...]
    real: Mapping[str, ComplexArray]

    def __add__(self, other: "ExactDrawings") -> "ExactDrawings":
        real = {name: np.concatenate([one, other.real[name]]) for name, one in self.real.items()}
        return ExactDrawings((*self.data, *other.data), real)


AT_SCALE_ONE = dict.fromkeys(SCALE_NAMES, np.asarray(1.0))
_everybody: deque[tuple[Assignment, Construction, ExactDrawings]] = deque(maxlen=16)


def drawn_by_variants(task: Task) -> ExactDrawings:
    """Return the exact drawings of all variants, the same for all students of an assignment."""
    for assignment, construction, exact in _everybody:
        if assignment is task.assignment and construction == task.construction:
            return exact
    exact = _all_variants(task)
    _everybody.append((task.assignment, task.construction, exact))
    return exact


def _all_variants(task: Task) -> ExactDrawings:
    variants = task.assignment.variants()
    one = np.ones(len(variants))
    try:
        together = parameters_for(task.assignment, variants, Scales(one, one, one, one))
        rule = task.assignment.scales(variants)
    except PlanmarkError:
        variants, together = [task.variant], {**task.parameters, **AT_SCALE_ONE}
        rule = task.assignment.scales(variants)
    rules = {name: np.broadcast_to(one, len(variants)) for name, one in rule.by_name.items()}
    data = tuple(
        Data(
            "other_variant",
            variant,
            parameters=_at(together, index, len(variants)),
            rule={name: float(one[index]) for name, one in rules.items()},
        )
        for index, variant in enumerate(variants)
    )
    return _exact(task.construction, together, data)


def _at(parameters: Parameters, index: int, count: int) -> dict[str, FloatArray]:
    """Return the parameters of one of many sets, without scales."""
    return {
        name: np.asarray(np.ravel(value)[index] if np.size(value) == count else np.ravel(value)[0])
        for name, value in parameters.items()
        if name not in SCALE_NAMES
    }


def _exact(construction: Construction, parameters: Parameters, data: tuple[Data, ...]) -> ExactDrawings:
    """Return the exact drawings; `parameters` are arrays over the sets."""
    return _between(construction, evaluate(construction, {**parameters, **AT_SCALE_ONE}), data)


def _between(construction: Construction, nodes: Nodes, data: tuple[Data, ...]) -> ExactDrawings:
    """Return the vectors and links between nodes, arrays over the sets."""
    ends = {one.name: (one.tail, one.head) for one in construction.vectors.values()} | dict(
        construction.links
    )
    with np.errstate(all="ignore"):
        real = {name: np.ravel(nodes[head] - nodes[tail]) for name, (tail, head) in ends.items()}
    return ExactDrawings(
        data, {name: np.array(np.broadcast_to(one, len(data))) for name, one in real.items()}
    )


def _misread(task: Task, angles: Mapping[str, float]) -> ExactDrawings | None:
    """Return the own data with the crank at misread angles, radians by the misreading; None without any."""
    if not angles:
        return None
    turned = {**task.parameters, CRANK: np.array(list(angles.values()))}
    data = tuple(
        Data("data_misread", task.variant, how, {**task.parameters, CRANK: np.asarray(angle)})
        for how, angle in angles.items()
    )
    return _exact(task.construction, turned, data)


def _own_otherwise(task: Task) -> ExactDrawings | None:
    """Return the own data in other assemblies; None if the mechanism has only one."""
    own = Data("own", task.variant)
    made = [
        _exact(task.construction.with_step(replace(step, side=-step.side)), task.parameters, (own,))
        for step in task.construction.figures[MECHANISM]
        if isinstance(step, TwoArcs | ArcAndLine)
    ]
    return _together(made)


def mistakes_in_plans(task: Task) -> list[Mistake]:
    """Return each single mistake in a plan that changes its shape."""
    construction = task.construction
    right = Drawing(construction, {**task.parameters, **AT_SCALE_ONE})
    return [
        mistake
        for figure in construction.poles
        for mistake in chain(
            single_mistakes(right, figure),
            _driving_along(construction, figure),
            _letters_swapped(construction, figure),
        )
        if mistake.code not in {"scale_wrong", "rpm_not_converted", "figure_rotated"}
    ]


def drawn_with_mistakes(task: Task) -> ExactDrawings | None:
    """Draw the own data with each of `mistakes_in_plans`: all of them together, step by step."""
    made = mistakes_in_plans(task)
    construction, parameters = task.construction, {**task.parameters, **AT_SCALE_ONE}
    nodes: dict[str, ComplexArray] = {}
    view = View(nodes, parameters)
    with np.errstate(all="ignore"):
        for step in construction.steps:
            nodes[step.node] = np.array(np.broadcast_to(step.place(view), len(made)))
            for row, mistake in enumerate(made):
                if mistake.at == step.node and mistake.code != "labels_swapped":
                    place = np.broadcast_to(changed_step(mistake, construction).place(view), len(made))
                    nodes[step.node][row] = place[row]
    for row, mistake in enumerate(made):
        if mistake.code == "labels_swapped":
            first, second = (nodes[name] for name in mistake.other)
            first[row], second[row] = second[row], first[row]
    return _between(construction, nodes, (Data("own", task.variant),) * len(made)) if made else None


def _letters_swapped(construction: Construction, figure: str) -> Iterator[Mistake]:
    """Yield two images of a plan with exchanged letters."""
    pole = construction.poles[figure]
    images = [v.head for v in construction.vectors_of(figure) if v.tail == pole and v.part not in {"n", "c"}]
    for pair in combinations(images, 2):
        yield Mistake("labels_swapped", pair[0], other=pair)


def _driving_along(construction: Construction, figure: str) -> Iterator[Mistake]:
    """Yield the driving link's vector along the link instead of across it, or across instead of along."""
    for step in construction.figures[figure]:
        for mistake in rarer_mistakes_of_step(step, construction):
            if mistake.code == "parallel_for_perpendicular":
                yield mistake


def _together(made: Sequence[ExactDrawings]) -> ExactDrawings | None:
    found: ExactDrawings | None = None
    names = made[0].real if made else ()
    if made:
        real = {name: np.concatenate([one.real[name] for one in made]) for name in names}
        found = ExactDrawings(tuple(data for one in made for data in one.data), real)
    return found


def own_first(everybody: ExactDrawings, task: Task) -> ExactDrawings:
    """Return the exact drawings of all variants, the student's own first."""
    own = next((index for index, one in enumerate(everybody.data) if one.variant == task.variant), 0)
    order = [own, *(index for index in range(len(everybody.data)) if index != own)]
    first, *others = (everybody.data[index] for index in order)
    return ExactDrawings(
        (replace(first, kind="own"), *others), {name: one[order] for name, one in everybody.real.items()}
    )


# All of them, with their probabilities --------------------------------------------------------------

COPIED, HALF_COPIED, MISREAD, ELSEWHERE_SHARE, NOBODYS = 0.01, 0.002, 0.005, 2e-5, 0.002
"""Prior probabilities: that the whole drawing follows another variant's data; that one part does; that the
crank's angle is misread; that the crank stands at any other angle; that a part follows no data."""
IN_OTHER_ASSEMBLY, WITH_MISTAKE = 0.02, 0.3
"""Prior probabilities for the own data: another assembly; a single mistake in a plan, if considered."""
QUARTER = 0.02
"""Prior probability, with the own data, that a plan is turned by a quarter as a whole."""
LEAST_TURNED_MM = 5.0
"""The direction of a shorter vector is too vague to tell anything."""


def sets_of(
    task: Task, drawn: DrawnParts, everybody: ExactDrawings, *, mistakes: bool
) -> tuple[ExactDrawings, FloatArray]:
    """Return all sets of data, the own one first, and their prior probabilities."""
    exact, others = everybody, max(len(everybody.data) - 1, 1)
    prior = [1.0 - COPIED - MISREAD, *([COPIED / others] * (len(everybody.data) - 1))]
    assemblies = task.cached(("owner", "assemblies"), lambda: _own_otherwise(task))
    wrong = task.cached(("owner", "mistakes"), lambda: drawn_with_mistakes(task)) if mistakes else None
    misread = task.cached(("owner", "misread"), lambda: _misread(task, _misread_angles(task)))
    elsewhere = _misread(task, _drawn_angles(task, drawn))
    shares = (IN_OTHER_ASSEMBLY, WITH_MISTAKE, MISREAD, ELSEWHERE_SHARE)
    for more, share in zip((assemblies, wrong, misread, elsewhere), shares, strict=True):
        if more is not None:
            exact += more
            prior += [share / len(more.data)] * len(more.data)
    return _with_plans_turned(task, exact, np.array(prior))


def _with_plans_turned(
    task: Task, exact: ExactDrawings, prior: FloatArray
) -> tuple[ExactDrawings, FloatArray]:
    """Return all sets, and the own ones with one or two of the plans turned by a quarter as a whole."""
    own = np.array([one.kind == "own" for one in exact.data])
    made, plans = [exact], tuple(task.construction.poles)
    for turned in chain.from_iterable(combinations(plans, count) for count in range(1, len(plans) + 1)):
        scales = {task.construction.vectors_of(plan)[0].scale for plan in turned}
        with np.errstate(invalid="ignore"):
            real = {
                name: one[own] * (1j if task.segments[name].scale in scales else 1.0)
                for name, one in exact.real.items()
            }
        made.append(ExactDrawings((Data("own", task.variant),) * int(own.sum()), real))
        prior = np.concatenate([prior, prior[: len(own)][own] * QUARTER ** len(turned)])
    return functools.reduce(operator.add, made), prior


SAME_RAD = math.radians(2.5)
"""Crank angles closer than this are the same."""


def _misread_angles(task: Task) -> dict[str, float]:
    """Return the angles at which a misread crank may stand; none without a crank."""
    given = task.parameters.get(CRANK)
    if given is None:
        return {}
    right = float(given)
    angles = {how: factor * right + math.radians(more) for how, (factor, more) in MISREADINGS.items()}
    return {how: one for how, one in angles.items() if _apart(one, right) > SAME_RAD}


def _drawn_angles(task: Task, drawn: DrawnParts) -> dict[str, float]:
    """Return the angles at which the crank was drawn, or stands by its vectors, if they are others."""
    given = task.parameters.get(CRANK)
    if given is None:
        return {}
    known = [float(given), *_misread_angles(task).values()]
    found: dict[str, float] = {}
    for vectors in drawn.values():
        for name, one in vectors.items():
            is_driving = task.segments[name].head in {task.pin, *_images(task)}
            if is_driving and one.direction_rad is not None and one.length_mm >= LEAST_TURNED_MM:
                angle = float(given) + one.direction_rad - cmath.phase(task.segments[name].real)
                if all(_apart(angle, other) > SAME_RAD for other in (*known, *found.values())):
                    found[f"{ELSEWHERE} {name}"] = angle
    return found


def _images(task: Task) -> Iterable[str]:
    """Return the heads of the driving link's vectors."""
    vectors = task.construction.vectors
    return [vectors[name].head for name in map(task.driving_vector, OF_MOTION) if name in vectors]


def _apart(one: float, other: float) -> float:
    return abs(math.remainder(one - other, math.tau))
