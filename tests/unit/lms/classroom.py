"""Results of a small class."""

from datetime import UTC, datetime

from grader.documents import MistakeDocument, ProblemDocument, ReportDocument, ResultsDocument, RubricDocument
from grader.lms.export import export
from grader.lms.grades import Options
from grader.texts.spoken import ENGLISH, clause
from tests.unit.feedback import works


def criterion(name, verdict, points, feedback=""):
    return works.criterion(name, verdict, points, feedback=feedback)


def report(student_id, score=None, *, status="graded", position=None, n=None, **more):
    fields = {
        "student_id": student_id,
        "assignment": "pump",
        "variant": {} if n is None else {"n": n},
        "position": position,
        "status": status,
        "score": score,
        "score_range": None if score is None else (score, score),
        "max_score": 10.0,
    }
    return ReportDocument(**{**fields, **more})


def results(*reports):
    rubric = RubricDocument(titles={"en": "Pump"}, changed="2026-11-22T18:00:00Z", criteria=[])
    return ResultsDocument(assignment="pump", rubric=rubric, reports=list(reports))


def a_class():
    return results(
        report(
            "s01", 7.5, n=1,
            criteria=[
                criterion("v_A", "full", 5.0, "Right."),
                criterion("v_B", "partial", 2.5, "It is too long."),
            ],
            mistakes=[MistakeDocument(code="sense_reversed", at="v_B", explains=["v_B"], confidence=0.9)],
        ),
        report(
            "s02", None, n=2, status="needs_review", score_range=(5.0, 10.0),
            criteria=[criterion("v_A", "full", 5.0), criterion("v_B", "review", None, "A person will look.")],
        ),
        report("s03", None, n=3, status="missing", score_range=None),
        report(
            "s04", None, n=4, status="unreadable", score_range=None,
            problems=[ProblemDocument(code="pdf_encrypted", message="password", file="=s04.pdf")],
        ),
    )  # fmt: skip


def marked(student_id, *points, position=None, status="graded", title="Vector {}", **more):
    """A report of criteria of five points each: points, None for what was not judged."""
    verdicts = {5.0: "full", 0.0: "none", None: "not_judged"}
    criteria = [
        criterion(f"c{place}", verdicts.get(one, "partial"), one, "Told <why> & how.").model_copy(
            update={"title": title.format(place)}
        )
        for place, one in enumerate(points, start=1)
    ]
    judged = [one for one in points if one is not None]
    score = sum(judged) * len(points) / len(judged)
    if status != "graded":
        score = None
    return report(
        student_id, score, status=status, position=position, max_score=5.0 * len(points), criteria=criteria,
        score_range=(0.0, 5.0 * len(points)), **more,
    )  # fmt: skip


def notes(delivery):
    """The notes on a file in English."""
    return [clause(note, ENGLISH) for note in delivery.notes]


def left_out(delivery):
    """The students who are not in a file, with the reasons in English."""
    return {
        student: ", ".join(clause(reason, ENGLISH) for reason in reasons)
        for student, _, reasons in delivery.left_out()
    }


NAMES_APART = (
    "LastName,FirstName,ID,SIS User ID,SIS Login ID,Section,Pump (1)\n"
    "    Points Possible,,,,,,10\nPopescu,Ion,1,s01,,1,\n"
)
"""A gradebook of Canvas with names in two columns."""


def form(tmp_path, text):
    """The file of a platform's own form."""
    path = tmp_path / "form.csv"
    path.write_text(text)
    return path


NOW = datetime(2026, 11, 22, 5, 0, tzinfo=UTC)


def moodle(tmp_path, what, *reports, name="out.json", **how):
    path = tmp_path / name
    delivery = export(results(*reports), path, Options(to="moodle", what=what, now=NOW, **how))
    return delivery, path
