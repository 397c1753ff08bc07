"""What stands as strokes on a mechanism's sketch: its bars between joints, and the joints in one place."""

from collections.abc import Iterator, Mapping

from reference.construction import Construction
from reference.elements import Fixed, Line
from reference.steps import ArcAndLine, Coincide, Divide, Given, Local, Step, Tangent, TwoArcs, TwoLines


def bars(construction: Construction) -> tuple[tuple[str, str], ...]:
    """Every bar that the steps of the sketch lay between two joints, from the earlier to the later one."""
    return tuple(
        (start, step.node)
        for step in construction.figures["mechanism"]
        for start in _starts(step, construction)
    )


def _starts(step: Step, construction: Construction) -> Iterator[str]:
    match step:
        case Given(start=start):
            yield start
        case TwoArcs(centres=centres):
            yield from centres
        case ArcAndLine(centre=centre) | Tangent(centre=centre):
            yield centre
        case Divide(base=base):
            yield base[0]
        case Local(origin=origin):
            yield origin
        case Coincide(node=node, other=other):
            # A slotted link's point turns about the link's pivot; a point under a slider has a bar already.
            velocities = (v.link for v in construction.vectors.values() if v.link and v.scale == "kv")
            yield from (pivot for pivot, head in velocities if head == node and pivot != other)
        case TwoLines(first=first, second=second):
            # The slot of a yoke; guides are no bars.
            lines = (line for line in (first, second) if isinstance(line, Line))
            yield from (line.through for line in lines if isinstance(line.along, Fixed))


def coincident(construction: Construction) -> Mapping[str, str]:
    """Joints that lie where another does at this instant, by name."""
    steps = construction.figures["mechanism"]
    return {step.node: step.other for step in steps if isinstance(step, Coincide)}
