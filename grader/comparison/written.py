"""A drawn length held against the one that the student measured and wrote into the sheet's cells."""

from grader.comparison.evidence import DrawnVector
from grader.comparison.limits import FULL, NONE, Mark, open_between
from grader.outcomes import Reason
from grader.rubric import ToleranceTable


def held_against_written(
    mark: Mark,
    drawn: DrawnVector,
    written: tuple[float, float] | None,
    tolerance: ToleranceTable,
    least: float,
) -> Mark:
    """The mark, open where the two lengths contradict each other: a person must look.

    Either the drawing is misread, or the cells, or the student has measured something else; nothing
    here says which. A ruler errs by no more than the tolerance of a length.

    Arguments: `written` is a length in mm and the probability that it is what stands in the cells,
    `least` the probability from which it counts.
    """
    if written is None or written[1] < least:
        return mark
    length_mm = written[0]
    allowed = tolerance.length_at(length_mm) + tolerance.certain_errors * drawn.se_mm
    if abs(drawn.length_mm - length_mm) <= allowed:
        return mark
    told: dict[str, float | str] = {"drawn": drawn.length_mm, "written": length_mm, "unit": "mm"}
    return open_between(NONE, FULL, mark, Reason("written_disagrees", told))
