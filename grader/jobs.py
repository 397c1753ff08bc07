"""The jobs of a run, one for each submission, and what all of them together tell."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.documents import AlikeDocument, ReportDocument
from grader.kept import code_version, kept_maps
from grader.moved import Inputs, inputs_of
from grader.pipeline import Work
from grader.rubric import RubricFile
from grader.similarity import compared_submission, find_similar
from grader.survey import Survey
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

    work: Work
    folder: str
    reading_key: str
    key: str

    @property
    def name(self) -> str:
        """Of what is kept of it."""
        return self.folder.replace("/", "#")


def folders_of(works: Iterable[Work]) -> list[str]:
    """Each work's folder below the results: the student's, with several positions one for each."""
    works = list(works)
    count = Counter(work.student_id for work in works)
    return [
        work.student_id if count[work.student_id] == 1 else f"{work.student_id}/{_position(work)}"
        for work in works
    ]


def _position(work: Work) -> str:
    position = None if work.variant is None else work.variant.position
    return "unknown" if position is None else str(position)


def inputs_of_run(
    assignment: Assignment, rubric: RubricFile, jobs: Sequence[Job], surveys: Sequence[Survey]
) -> Inputs:
    """What this run's marks come from, for the next run to tell what has changed."""
    files = (assignment.file.model_dump_json(), assignment.mechanism_file.model_dump_json())
    authored = {
        "assignment": repr(files),
        "rubric": rubric.model_dump_json(),
        "program": code_version(),
    }
    content = {source.file: source.digest for one in surveys for source in one.pages}
    return inputs_of(authored, [job.work for job in jobs], [job.folder for job in jobs], content)


def similar_of_run(
    assignment: Assignment, jobs: Sequence[Job], reports: Sequence[ReportDocument], readings: Path
) -> list[AlikeDocument]:
    """The similar sheets among those that were marked."""
    marked = [
        (job, compared_submission(report, job.work.variant, job.work.measured))
        for job, report in zip(jobs, reports, strict=True)
        if job.work.variant is not None and report.criteria
    ]
    maps = [kept_maps(readings, job.name) for job, _ in marked]
    return find_similar(assignment, [one for _, one in marked], maps)
