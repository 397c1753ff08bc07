"""The class's page. Self-contained, readable offline and on paper."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from grader.documents import ReportDocument, ResultsDocument
from grader.feedback import statistics
from grader.feedback.mistakes import MISTAKES
from grader.feedback.problems import problem_sentence, unmatched_sentence
from grader.feedback.templating import environment, told_score
from grader.files import write_whole
from grader.i18n import tongue
from grader.scene import COLOURS

_NO_NAMES: Mapping[str, str] = {}


def write_index(
    results: ResultsDocument,
    out_dir: Path,
    lang: str,
    *,
    title: str = "",
    student_names: Mapping[str, str] = _NO_NAMES,
) -> None:
    """Write `index.html`, the class at a glance, into a folder; `student_names` by student_id."""
    write_whole(out_dir / "index.html", index_page(results, lang, title=title, student_names=student_names))


def index_page(
    results: ResultsDocument, lang: str, *, title: str = "", student_names: Mapping[str, str] = _NO_NAMES
) -> str:
    """The class's page."""
    speaker = tongue(lang)
    folders = folders_of(results.reports)
    rows = [
        {
            "report": report,
            "name": student_names.get(report.student_id, ""),
            "link": f"{quote(folder)}/feedback.html",
            "score": told_score(report, speaker),
            "waiting": sum(criterion.verdict == "review" for criterion in report.criteria),
            "problems": Counter(
                problem_sentence(problem, speaker, brief=True) for problem in report.problems
            ),
            "best": report.score if report.score is not None else (report.score_range or (-1.0, -1.0))[0],
        }
        for report, folder in zip(results.reports, folders, strict=True)
    ]
    return environment(speaker.lang).get_template("index.html").render(
        results=results,
        title=title or results.assignment,
        rows=rows,
        has_positions=any(report.position is not None for report in results.reports),
        has_n=any("n" in report.variant for report in results.reports),
        unmatched=[unmatched_sentence(one, speaker) for one in results.unmatched],
        states=statistics.states(results),
        chart=statistics.distribution_svg(results, speaker),
        hardest=statistics.hardest(results),
        commonest=[
            (MISTAKES[code].title, count) for code, count in statistics.commonest(results) if code in MISTAKES
        ],
        colours=COLOURS,
    )  # fmt: skip


def folders_of(reports: Sequence[ReportDocument]) -> list[str]:
    """Each report's folder below the output folder: the student, with several positions also that."""
    counts: dict[str, int] = {}
    for report in reports:
        counts[report.student_id] = counts.get(report.student_id, 0) + 1
    return [
        report.student_id
        if counts[report.student_id] == 1
        else f"{report.student_id}/{'unknown' if report.position is None else report.position}"
        for report in reports
    ]
