"""The jobs of a run, one for each submission, and what all of them together tell."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.documents import AlikeDocument, ReportDocument
from grader.kept import MARK_STAGE, kept_maps, stage_digest
from grader.measurements import StudentSubmission
from grader.moved import Inputs, inputs_of
from grader.rubric import RubricFile
from grader.similarity import compared_submission, find_similar
from grader.survey import FileContent
from reference.assignment import Assignment


@dataclass(frozen=True, slots=True)
class Job:
    """One submission to mark.

    Attributes
    ----------
    folder : below the results: the student's, with several positions one for each
    reading_key : a digest of everything that the reading of its pages depends on
    key : a digest of everything that its report depends on
    """

    submission: StudentSubmission
    folder: str
    reading_key: str
    key: str

    @property
    def name(self) -> str:
        """Of what is kept of it."""
        return self.folder.replace("/", "#")


def folders_of(submissions: Iterable[StudentSubmission]) -> list[str]:
    """Each submission's folder below the results: the student's, with several positions one for each."""
    submissions = list(submissions)
    count = Counter(submission.student_id for submission in submissions)
    return [
        submission.student_id
        if count[submission.student_id] == 1
        else f"{submission.student_id}/{_position(submission)}"
        for submission in submissions
    ]


def _position(submission: StudentSubmission) -> str:
    position = None if submission.variant is None else submission.variant.position
    return "unknown" if position is None else str(position)


def inputs_of_run(
    assignment: Assignment, rubric: RubricFile, jobs: Sequence[Job], contents: Sequence[FileContent]
) -> Inputs:
    """What this run's marks come from, for the next run to tell what has changed."""
    files = (assignment.file.model_dump_json(), assignment.mechanism_file.model_dump_json())
    authored = {
        "assignment": repr(files),
        "rubric": rubric.model_dump_json(),
        "program": stage_digest(MARK_STAGE),
    }
    digests = {page.file: page.digest for content in contents for page in content.pages}
    return inputs_of(authored, [job.submission for job in jobs], [job.folder for job in jobs], digests)


def similar_of_run(
    assignment: Assignment, jobs: Sequence[Job], reports: Sequence[ReportDocument], readings: Path
) -> list[AlikeDocument]:
    """The similar sheets among those that were marked."""
    marked = [
        (job, compared_submission(report, job.submission.variant, job.submission.measured))
        for job, report in zip(jobs, reports, strict=True)
        if job.submission.variant is not None and report.criteria
    ]
    maps = [kept_maps(readings, job.name) for job, _ in marked]
    return find_similar(assignment, [one for _, one in marked], maps)
