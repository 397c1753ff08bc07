"""Find contradictions within reports: sentence, measured, expected, tolerance, points and score.

    python -m tests.bench.contradictions OUT/results.json ...

Reads the results of `planmark grade --lang en` (only English sentences are compared with the numbers) and
prints each contradiction with its student and criterion. The exit status is 1 where there are any.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from grader.documents import CriterionDocument, Quantity, ReportDocument, ResultsDocument
from grader.feedback.numbers import parts_of

SLACK = 1e-5
"""Excess over a tolerance or over points by rounding."""
ROUNDING = 0.06
"""Largest difference of two numbers that are rounded to one decimal."""
OPPOSITE_DEG = 150.0
DOUBTS = re.compile(r"too close to|too little (certainty|to decide)|a person must look|an instructor will")
NOT_READ = re.compile(r"could not be read|Nothing was handed in|is not required")
COUNTED = {"counted_for_you", "at_stake"}
"""Reasons that say why more than the tolerance is right."""
AGAINST_THE_DATA = "compared with the data"
"""After it numbers are told that are not the row's: what was expected there follows from own values."""
OFF = re.compile(
    r"too (long|short) by|turned [\d.]+°|opposite way|is too (large|small)|times too (large|small)"
)
IN_FAVOUR = re.compile(r"accepted\.|^Right\.")
LENGTH = re.compile(r"too (long|short) by ([\d.]+)")
TURN = re.compile(r"turned ([\d.]+)°")


def contradictions(report: ReportDocument) -> Iterator[str]:
    """The contradictions in a report, each with its criterion."""
    for criterion in report.criteria:
        for what in (*_of_verdict(criterion), *_of_sentence(criterion), *_of_proposal(criterion)):
            yield f"{criterion.id}: {what}"
    yield from _of_mistakes(report)
    yield from _of_score(report)


def _offs(criterion: CriterionDocument) -> dict[str, float]:
    """Differences of measured and expected length, direction and value, where both are there."""
    offs = {}
    for name in ("length_mm", "direction_deg", "value"):
        one, other = getattr(criterion.measured, name), getattr(criterion.expected, name)
        if one is not None and other is not None:
            apart = one - other
            offs[name] = abs((apart + 180.0) % 360.0 - 180.0) if name == "direction_deg" else abs(apart)
    return offs


def _beyond(criterion: CriterionDocument) -> list[str]:
    """The quantities beyond the tolerance shown, except a direction that is not judged."""
    is_short = "too_short_to_judge" in criterion.reasons
    return [
        name
        for name, off in _offs(criterion).items()
        if (allowed := getattr(criterion.tolerance, name)) is not None
        if off > allowed * (1.0 + SLACK) and not (name == "direction_deg" and is_short)
    ]


def _of_verdict(criterion: CriterionDocument) -> Iterator[str]:
    """Contradictions of a verdict with tolerance and points."""
    verdict, points = criterion.verdict, criterion.points
    beyond = _beyond(criterion)
    is_lenient = criterion.decided is not None or COUNTED & set(criterion.reasons)
    if verdict == "full" and beyond and not is_lenient:
        yield f"right, but {', '.join(beyond)} beyond the tolerance"
    if verdict == "follow_through" and beyond and "follows" not in criterion.reasons:
        yield f"follows, but {', '.join(beyond)} beyond the tolerance"
    is_drawn = criterion.measured.length_mm is not None and criterion.tolerance.length_mm is not None
    if verdict in {"none", "partial"} and is_drawn and not beyond and criterion.mistake != "arithmetic":
        yield "loses points, but is within the tolerance"
    is_open = verdict in {"review", "not_judged"}
    if is_open != (points is None):
        yield f"{verdict}, but {points} points"
    rights = {"full": criterion.max_points, "follow_through": criterion.max_points, "none": 0.0}
    if criterion.decided is None and abs((points or 0.0) - rights.get(verdict, points or 0.0)) > SLACK:
        yield f"{verdict}, but {points} of {criterion.max_points} points"


def _of_sentence(criterion: CriterionDocument) -> Iterator[str]:
    """Contradictions of a sentence with numbers and verdict."""
    said = criterion.feedback
    if not said:
        yield "nothing is said"
    if NOT_READ.search(said) and criterion.measured != Quantity(unit=criterion.measured.unit):
        yield f"'{said}' beside a measured value"
    if criterion.verdict != "review" and DOUBTS.search(said):
        yield f"settled, but '{said}'"
    if criterion.verdict == "review" and said.startswith("Right."):
        yield f"waits, but '{said}'"
    if AGAINST_THE_DATA in said:
        return
    offs = _offs(criterion)
    for pattern, name in ((LENGTH, "length_mm"), (TURN, "direction_deg")):
        told = pattern.search(said)
        if told is None or name not in offs:
            continue
        if abs(float(told[told.lastindex or 1]) - offs[name]) > ROUNDING:
            yield f"'{told[0]}', but {offs[name]:.1f} by the numbers shown"
    if "points the opposite way" in said and offs.get("direction_deg", 0.0) < OPPOSITE_DEG:
        yield "opposite, but the directions shown are near"


def _of_proposal(criterion: CriterionDocument) -> Iterator[str]:
    """Contradictions of a proposed verdict with the sentence and the numbers beside it."""
    said, proposed = criterion.feedback, criterion.proposed
    if criterion.verdict != "review" or proposed is None:
        return
    if proposed in {"full", "follow_through"} and OFF.search(said):
        yield f"proposed {proposed}, but '{said}'"
    if proposed in {"partial", "none"} and IN_FAVOUR.search(said):
        yield f"proposed {proposed}, but '{said}'"
    measured, expected = criterion.measured, criterion.expected
    is_same = measured.value is not None and measured.value == expected.value
    if proposed == "none" and is_same and not OFF.search(said):
        yield f"proposed none, but measured and expected are both {measured.value}"


def _of_mistakes(report: ReportDocument) -> Iterator[str]:
    """Contradictions of mistakes with the verdicts that they explain."""
    verdicts = {criterion.id: criterion.verdict for criterion in report.criteria}
    for mistake in report.mistakes:
        explained = {verdicts[name] for name in mistake.explains if name in verdicts}
        if explained and explained <= {"full"}:
            yield f"{mistake.code} at {mistake.at} explains nothing but what is right"


def _of_score(report: ReportDocument) -> Iterator[str]:
    """Contradictions of the score with the sum of the rows."""
    parts = parts_of(report)
    if not parts:
        return
    settled = sum(part.result for part in parts)
    if report.score is not None and abs(settled + report.added - report.score) > 1e-3:
        yield f"score {report.score}, but the rows add up to {settled:.3f}"
    if report.score is None and report.score_range is not None:
        low, high = (end - report.added for end in report.score_range)
        if not settled - 1e-3 <= low <= high:
            yield f"between {low} and {high}, but the settled rows alone add up to {settled:.3f}"


def main(paths: list[str]) -> int:
    """Print the contradictions; return the exit status."""
    found = 0
    for path in paths:
        results = ResultsDocument.model_validate_json(Path(path).read_bytes())
        for report in results.reports:
            for what in contradictions(report):
                found += 1
                print(f"{path}: {report.student_id} {report.position or ''} {what}")
    print(f"{found} contradictions")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
