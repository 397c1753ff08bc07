"""Find what pages show that do not read as their student's drawing: a mirror image, another assignment."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace

from grader.reading.read import read_figures
from grader.reading.vectors import MOST_OPEN
from grader.records import Ink, Reading, Reason, ScannedPage, Sheet
from reference.authored.assignment import Assignment, Variant, load_assignment, names_in
from reference.errors import PlanmarkError

SURE = 0.9
"""Confidence from which a vector counts as read."""
LEAST, FAR_BETTER = 12, 2
"""A velocity plan alone, of eight vectors, was surely read in its mirror image."""


def told_instead(
    pages: Sequence[ScannedPage],
    assignment: Assignment,
    variant: Variant | None,
    wanted: Collection[str] = (),
) -> list[ScannedPage]:
    """Return a student's pages; where they were hardly read, with what they show instead, if that fits.

    Arguments: `wanted` are the names asked for, all by default.
    """
    drawn = [(one.ink, one.sheet) for one in pages if one.ink and one.sheet and not one.sheet.zones]
    readings = [page.reading for page in pages]
    # At a dead point little can be read: on sheets with all positions another one shows whose they are.
    positions = assignment.shared_positions if drawn else ()
    others = (replace(variant, position=one) for one in positions) if variant is not None else ()
    is_read = _is_read(readings) or any(
        _is_read(read_figures(drawn, assignment, other, None, wanted)) for other in others if other != variant
    )
    shown = None if is_read or not drawn else _shown(drawn, _surely(readings), assignment, variant)
    if shown is None:
        return list(pages)
    return [replace(one, problems=(replace(shown, file=one.ref.file), *one.problems)) for one in pages]


def _is_read(readings: Sequence[Reading]) -> bool:
    """Return whether much is read surely, or most of what is named."""
    # Forces whose sense alone is open are read, too.
    own, named = (_surely(readings, least) for least in (MOST_OPEN, 0.0))
    return own >= LEAST or (named > 0 and FAR_BETTER * own >= named)


def _shown(
    drawn: Sequence[tuple[Ink, Sheet]], own: int, assignment: Assignment, variant: Variant | None
) -> Reason | None:
    """Return what pages show of which `own` vectors were surely read; other assignments with any variant."""
    mirrored = [(ink.mirrored(), sheet) for ink, sheet in drawn]
    if variant is not None and _read_as(mirrored, assignment, variant) >= max(LEAST, FAR_BETTER * own):
        return Reason("sheet_mirrored")
    least = max(LEAST, FAR_BETTER * max(own, _read_as(drawn, assignment)))
    fits = {other.id: _read_as(drawn, other) for other in _beside(assignment)}
    best = max(fits, key=lambda name: fits[name], default="")
    is_far_better = fits.get(best, 0) >= least
    return Reason("sheet_of_another", {"other": best, "own": assignment.id}) if is_far_better else None


def _surely(readings: Iterable[Reading], least: float = SURE) -> int:
    figures = [figure for reading in readings for figure in reading.figures.values()]
    return sum(one.confidence >= least for figure in figures for one in figure.vectors.values())


def _read_as(drawn: Sequence[tuple[Ink, Sheet]], assignment: Assignment, own: Variant | None = None) -> int:
    return _surely(read_figures(drawn, assignment, own, None, ()))


def _beside(assignment: Assignment) -> Iterator[Assignment]:
    """Yield the other assignments with files in the same folder, without those that have faults."""
    for name in names_in(assignment.path.parent, "assignment"):
        path = assignment.path.parent / f"{name}.assignment.toml"
        try:
            if path != assignment.path:
                yield load_assignment(path)
        except PlanmarkError:
            continue
