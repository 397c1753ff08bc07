"""The check of measured values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.language import Tongue
from grader.marking.mark import judge
from grader.options import Level
from grader.outcomes import Judgement
from grader.rubric import rubric_of
from grader.self_check.advice import CheckedLine, checked_lines
from grader.tables.measurements import Measurements
from grader.texts.spoken import message
from reference.authored.assignment import Assignment, Variant

if TYPE_CHECKING:
    from grader.overlay.scene import Picture


@dataclass(frozen=True, slots=True)
class SelfCheck:
    """The results of a self-check, in the student's language; nothing in it gives the answer away.

    Attributes
    ----------
    lines : one for every requested value that was handed in, or could not be read on a photo (`open`)
    problems : what else a student should know
    judgement : None if nothing was read on a photo
    flaws : flaws of a photo, by code, with what to do
    pictures : each page of a photo with the reading on it, without expected vectors
    """

    lines: tuple[CheckedLine, ...] = ()
    problems: tuple[str, ...] = ()
    judgement: Judgement | None = None
    flaws: Mapping[str, str] = field(default_factory=dict)
    pictures: "tuple[Picture, ...]" = ()

    @property
    def is_all_right(self) -> bool:
        """True if something was handed in and read, and nothing is off or open."""
        return bool(self.lines) and all(line.result == "right" for line in self.lines)


def check_values(
    entered: Measurements, assignment: Assignment, variant: Variant, speaker: Tongue, level: Level
) -> SelfCheck:
    """Check a student's measured values.

    Raises MechanismError for a variant whose mechanism does not assemble.
    """
    evidence = Submission(measured=entered.reading, values=entered.values, declared=entered.scales)
    judgement = judge(task_of(assignment, rubric_of(assignment), variant), evidence)
    problems = tuple(message(one, speaker) for one in (*entered.problems, *entered.reading.problems))
    return SelfCheck(tuple(checked_lines(judgement, level, speaker, assignment)), problems, judgement)
