"""What a run changed against the one before it: every student's standing then and now."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from grader.documents import MovedDocument, ReportDocument, StandingDocument

Standings = Mapping[tuple[str, int | None], StandingDocument]
"""By student and position."""


def earlier_standings(results: Path, assignment: str) -> Standings | None:
    """Where everybody stood at the end of the last run; None where there was none of this assignment."""
    try:
        told: Any = json.loads(results.read_bytes())
        if told["assignment"] != assignment:
            return None
        return {
            (one["student_id"], one["position"]): StandingDocument(
                status=one["status"], score=one["score"], score_range=one["score_range"]
            )
            for one in told["reports"]
        }
    except (OSError, KeyError, TypeError, ValueError, ValidationError):
        return None


def moved(before: Standings | None, reports: Sequence[ReportDocument]) -> list[MovedDocument]:
    """Who stands elsewhere than before, who is new and who is gone; nobody after a first run."""
    if before is None:
        return []
    after = {(one.student_id, one.position): standing(one) for one in reports}
    return [
        MovedDocument(student_id=student, position=position, before=before.get(key), after=after.get(key))
        for key in dict.fromkeys((*after, *before))
        for student, position in [key]
        if before.get(key) != after.get(key)
    ]


def standing(report: ReportDocument) -> StandingDocument:
    """A report's standing."""
    return StandingDocument(status=report.status, score=report.score, score_range=report.score_range)


def told_standing(one: StandingDocument | None) -> str:
    """A standing in a few words: ``17.5``, ``12..18 needs review``, ``missing``."""
    if one is None:
        return "-"
    words = one.status.replace("_", " ")
    if one.score is not None:
        return f"{one.score:g}" if one.status == "graded" else f"{one.score:g} {words}"
    if one.score_range is not None:
        return f"{one.score_range[0]:g}..{one.score_range[1]:g} {words}"
    return words
