"""``planmark grade``, ``planmark demo`` and ``planmark read``."""

import importlib
import json
import math
import os
import re
import shutil
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import ModuleType

from grader.cli import terminal
from grader.cli.app import new_table, progress
from grader.cli.checking import checked_level
from grader.cli.terminal import gettext, note, tell_next
from grader.documents import AlikeDocument, ReadingDocument, ReportDocument, ResultsDocument
from grader.feedback.class_page import SIGNS, change_lines, trust_sentences, write_demo_page
from grader.feedback.class_statistics import waiting
from grader.feedback.words import STATES, problem_sentence, unmatched_sentence
from grader.files import make_folder, samples_folder, shown_text
from grader.folder.archives import is_archive
from grader.folder.batch import Batch, grade
from grader.folder.watch import arrivals
from grader.folder.workers import Limits, Workers, result_of
from grader.language import N_, ROOT_LANGUAGE, Tongue
from grader.lms.grades import in_a_row
from grader.marking.report import reading_document
from grader.options import ClassOptions, GradeOptions, VariantOptions, taken
from grader.pipeline import read_pages
from grader.records import PageRef, Reason, ScannedPage
from grader.rubric import Asked, rubric_of
from grader.scan.decode.pages import count_pages
from grader.scan.page import open_page
from grader.texts.spoken import at_terminal, clause, failure, place
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.errors import CallError, InputFileError


def grade_folder(folder: Path, name: str, out: Path, options: GradeOptions) -> ResultsDocument:
    """Grade a folder and print the outcome.

    What comes into a folder that is watched counts too, until Ctrl+C; a cluster's workers do its work.
    """
    wanted, cluster, decisions = checked_level(options.level), options.cluster, options.decisions
    if decisions is not None and not decisions.is_file():
        raise failure(CallError, "file_missing", "decisions_missing", file=decisions)
    assignment = load_assignment(name)
    rubric = rubric_of(assignment)
    address = address_of(folder)
    if address is not None and cluster is None:
        raise failure(CallError, "cluster_needed", folder=address)
    if cluster is not None:
        on_cluster = _cluster_module()
        if address is not None:
            folder, decisions = on_cluster.image_of(address, out), decisions or out / "decisions.csv"
        elif not folder.is_dir():
            raise failure(CallError, "folder_missing", folder=folder)
        if archive := next((path for path in folder.rglob("*") if is_archive(path)), None):
            raise failure(CallError, "archive_on_cluster", file=archive)
    limits = Limits(options.time_limit, options.memory_limit)
    given = {**taken(ClassOptions, options), "level": wanted, "decisions": decisions}
    batch = Batch(
        assignment, rubric, folder, out, jobs=options.jobs or os.cpu_count() or 1, limits=limits, **given
    )
    if options.watch and cluster is not None:
        raise failure(CallError, "option_unused", "unused_beside", option="--cluster", other="--watch")
    if options.watch:
        return _watch(batch, options.every)
    with ExitStack() as stack:
        pool = None
        if cluster is not None:
            make_folder(out)
            pool = stack.enter_context(on_cluster.Cluster(cluster, folder, out, batch.limits, address))
        results = grade(batch, stack.enter_context(progress()), pool)
    tell_class(results, out)
    return results


NAMED = 4
"""Files named of those that came together."""


def _watch(batch: Batch, seconds: float) -> ResultsDocument:
    """Grade what comes into a folder until Ctrl+C; the class as it then is, told as after any run."""
    results = None
    note(gettext("Watching %(folder)s; Ctrl+C ends it", folder=batch.folder))
    with Workers(batch.jobs, batch.limits, "grader.folder.batch") as workers:
        for now, names in _until_interrupted(arrivals(batch, seconds)):
            try:
                with progress() as tell:
                    results = grade(now, tell, workers)
            except CallError as error:
                if error.code not in {"nothing_to_grade", "results_in_use"}:
                    raise
                note(f"{time.strftime('%H:%M:%S')} {at_terminal(error, terminal.speaker())}")
                continue
            came = in_a_row(names, NAMED, terminal.speaker())
            note(f"{time.strftime('%H:%M:%S')} {came}; {_states(results)}")
    if results is None:
        raise failure(CallError, "nothing_to_grade", "nothing_came", folder=batch.folder)
    tell_class(results, batch.out)
    return results


def _until_interrupted(arrived: Iterator[tuple[Batch, list[str]]]) -> Iterator[tuple[Batch, list[str]]]:
    """Yield what comes, until somebody ends the waiting."""
    while True:
        try:
            batch = next(arrived)
        except KeyboardInterrupt:
            return
        yield batch


_URL = re.compile(r"((?:[a-z0-9+]+::)*[a-z0-9+]{2,}):[/\\]+(.*)", re.DOTALL)
"""An address as a path has it, with one slash for two; a single letter is a drive of Windows."""


def address_of(folder: Path) -> str | None:
    """The address that was given as a folder, such as `s3://bucket/class`; None for a path."""
    match = _URL.fullmatch(str(folder))
    if match is None or folder.exists():
        return None
    scheme, rest = match.groups()
    return f"{scheme}://{'/' if scheme.endswith('file') else ''}{rest}"


def fill_image(folder: Path) -> None:
    """Copy what was handed in elsewhere, where this folder is only an image of it."""
    if folder.with_name("address").is_file():
        _cluster_module().fill(folder)


def _cluster_module() -> ModuleType:
    try:
        return importlib.import_module("grader.folder.cluster")
    except ModuleNotFoundError as error:
        raise failure(CallError, "extra_missing", extra="cluster", error=error) from error


def demo(out: Path, jobs: int | None) -> None:
    """Grade the bundled samples, and write the page that leads to their classes."""
    classes, lang = {}, terminal.speaker().lang
    for name in ("pump", "press"):
        note(gettext("Grading the sample class %(name)s", name=name))
        # A copy: what is decided on it lies beside it.
        folder = out / "handed-in" / name
        shutil.copytree(samples_folder() / name, folder, dirs_exist_ok=True)
        results = grade_folder(folder, name, out / name, GradeOptions(jobs=jobs, lang=lang))
        title = load_assignment(name).file.title.in_language(lang)
        classes[name] = (title, results)
    write_demo_page(classes, out, lang)
    note(gettext("Open %(page)s", page=out / "index.html"))
    tell_next("review", out / "pump", before=N_("settle or change marks with %(command)s"))


def read_scans(scans: Sequence[Path], name: str, options: VariantOptions, *, as_json: bool) -> bool:
    """Read pages without grading; whether anything is doubtful or unread."""
    assignment = load_assignment(name)
    variant = _variant(assignment, options.n, options.position)
    with Workers(1, Limits(), __name__) as workers:
        refs = [ref for path in scans for ref in result_of(workers, _refs, path)]
        documents = result_of(workers, _read, refs, assignment, variant, sheets=len(refs))
    if as_json:
        terminal.say(json.dumps([document.model_dump(mode="json") for document in documents], indent=2))
    else:
        for document in documents:
            _print_reading(document)
    return any(not document.figures or document.unread or _doubtful(document) for document in documents)


def _read(refs: Sequence[PageRef], assignment: Assignment, variant: Variant | None) -> list[ReadingDocument]:
    units = Asked(assignment=assignment).units
    pages = [open_page(ref, units=units) for ref in refs]
    read = [
        replace(page, problems=(*page.problems, *(replace(flaw, file=page.ref.file) for flaw in page.flaws)))
        for page in read_pages(pages, assignment, variant, {}, rubric_of(assignment).vectors)
    ]
    return [reading_document(page, _student_of(page)) for page in read]


def _student_of(page: ScannedPage) -> str | None:
    """Return the student of a printed sheet."""
    identity = None if page.sheet is None else page.sheet.identity
    return None if identity is None else identity.student_id


def _variant(assignment: Assignment, n: int | None, position: int | None) -> Variant | None:
    """The variant, None where n or position is left open: any of them may then have been drawn."""
    numbers, positions = assignment.numbers("n"), assignment.numbers("position")
    is_open = (numbers is not None and n is None) or (positions is not None and position is None)
    if is_open and (n is None or numbers is None or n in numbers):
        return None
    return assignment.variant(n, position)


def _refs(path: Path) -> list[PageRef]:
    """A file's pages; of a file that cannot be opened the first, which will say why."""
    name = shown_text(path.name)
    try:
        return [PageRef(name, page, path=path) for page in range(1, count_pages(path) + 1)]
    except InputFileError as error:
        if error.code == "file_missing":
            raise
        return [PageRef(name, path=path)]


def _doubtful(document: ReadingDocument) -> bool:
    return any(
        vector.confidence < 0.9 for figure in document.figures.values() for vector in figure.vectors.values()
    )


def _print_reading(document: ReadingDocument) -> None:
    from rich.console import Console

    console = Console()
    page = gettext("page %(page)s", page=document.page)
    console.print(f"[bold]{document.source}[/bold], {page}", highlight=False)
    for problem in document.problems:
        text = problem_sentence(problem, terminal.speaker()).text
        console.print(f"  {problem.code}: {text}", highlight=False, markup=False)
    for name, figure in document.figures.items():
        head = N_("length, mm"), "±", N_("direction, °"), "±", N_("confidence")
        table = new_table(place(name, terminal.speaker()), *head)
        for vector, one in figure.vectors.items():
            length = "-" if one.length_mm is None else f"{one.length_mm:.2f}"
            direction = "-" if one.direction_deg is None else f"{one.direction_deg:.2f}"
            se_deg = "-" if one.se_deg is None else f"{one.se_deg:.2f}"
            table.add_row(vector, length, f"{one.se_mm:.2f}", direction, se_deg, f"{one.confidence:.2f}")
        if figure.vectors:
            console.print(table)
    for gap in document.unread:
        told = gettext("%(name)s: not read: %(why)s", name=gap.name, why=clause(gap, terminal.speaker()))
        console.print(f"  {told}", highlight=False, markup=False)


# A graded class on the terminal ----------------------------------------------------------

SHOWN = 12


def tell_class(results: ResultsDocument, out: Path) -> None:
    """Print states, changes, similar sheets, what waits for a person, and the paths of the results."""
    terminal.speak(results.lang or ROOT_LANGUAGE)
    note(_states(results))
    note(_left(results))
    speaker = terminal.speaker()
    for sentence in trust_sentences(results, speaker):
        note(sentence)
    page = out / "index.html"
    changes = list(change_lines(results, speaker))
    _list(gettext("Changed since the last run: %(count)s", count=len(results.moved)), changes, page)
    pairs = [_similar_line(pair) for pair in results.alike]
    _list(gettext("Similar sheets (no accusation; compare them side by side):"), pairs, page)
    stale = [
        gettext("line %(line)s, ", line=one.line) + f"{_who(one.student_id, one.position)} {one.criterion}"
        f" {one.verdict}: {clause(Reason(one.code), speaker) or one.reason}"
        for one in results.stale
    ]
    outdated = N_("Decisions that are out of date, and were not applied; decide again or remove them:")
    _list(gettext(outdated), stale, page)
    _list(gettext("A person must look at:"), list(_waiting(results, speaker)), page)
    note(gettext("Open %(page)s; programs read %(file)s", page=page, file=out / "results.json"))


def _states(results: ResultsDocument) -> str:
    states = Counter(report.status for report in results.reports)
    told = ", ".join(f"{gettext(STATES[state])} {count}" for state, count in states.most_common())
    num = len(results.reports)
    many = terminal.speaker().ngettext("%(num)d submission", "%(num)d submissions", num) % {"num": num}
    return f"{many}: {told}" if told else many


def tell_next_of_class(results: ResultsDocument, out: Path, platform: str | None = None) -> None:
    """Print what comes after grading: the review while anything waits for it, else the export."""
    if waiting(results) or results.unmatched or results.stale:
        tell_next("review", out)
    else:
        tell_next("export", out, "--to", platform or "PLATFORM")


SECONDS_A_LOOK = 6.0
"""Time that a person needs for a criterion at the review's screen."""
LOOKS_A_PAGE = 3
"""A page that is nobody's, or that was not read at all, takes as long as so many criteria."""


def _left(results: ResultsDocument) -> str:
    """Return what is finished, what waits, and how long a person will need for it."""
    finished = sum(report.status == "graded" for report in results.reports)
    waits = waiting(results)
    looks = sum(len(wait.criteria) or LOOKS_A_PAGE for wait in waits) + LOOKS_A_PAGE * len(results.unmatched)
    minutes = math.ceil(looks * SECONDS_A_LOOK / 60.0)
    count = len(waits) + len(results.unmatched)
    review = gettext("%(count)s, about %(minutes)s min of review", count=count, minutes=minutes)
    left = review if looks else gettext("nothing")
    text = gettext("Finished: %(count)s; waiting: %(left)s", count=finished, left=left)
    if (wrong := results.expected_wrong) is None:
        return text
    return text + gettext("; settled verdicts expected to be wrong: %(count).1f", count=wrong)


def _list(title: str, lines: Sequence[str], page: Path) -> None:
    if lines:
        terminal.say(title)
        for line in lines[:SHOWN]:
            terminal.say(f"  {line}")
        if len(lines) > SHOWN:
            told = gettext("... and %(more)s more, all in %(page)s", more=len(lines) - SHOWN, page=page)
            terminal.say(f"  {told}")


def _waiting(results: ResultsDocument, speaker: Tongue) -> Iterator[str]:
    """Lines on unmatched files, on what waits (most points at stake first), and on missing students."""
    for page in results.unmatched:
        place = f"{page.file}{'' if page.page is None else f'#{page.page}'}"
        yield _placed(place, unmatched_sentence(page, speaker).text)
    for wait in waiting(results):
        report = wait.report
        num = len(wait.criteria)
        count = speaker.ngettext("%(num)d criterion", "%(num)d criteria", num) % {"num": num}
        stake = speaker.gettext("%(points)s points at stake") % {"points": f"{wait.points:.4g}"}
        yield _standing(report, speaker, f", {count}, {stake}" if num else "")
    for report in results.reports:
        if report.status == "missing":
            yield _standing(report, speaker)


def _standing(report: ReportDocument, speaker: Tongue, about: str = "") -> str:
    """A student's state, and the first problem of the report, behind its file."""
    told = [problem_sentence(one, speaker) for one in report.problems[:1]]
    first = "".join(f"; {_placed(one.file, one.text)}" for one in told)
    return (
        f"{_who(report.student_id, report.position)}: {speaker.gettext(STATES[report.status])}{about}{first}"
    )


def _placed(place: str, message: str) -> str:
    """The message behind its place; an error's own words begin with it."""
    return message if not place or message.startswith(f"{place}:") else f"{place}: {message}"


def _similar_line(pair: AlikeDocument) -> str:
    who = ", ".join(_who(*key) for key in zip(pair.students, pair.positions, strict=True))
    chance = pair.measure and gettext(" (%(count).1g such pairs by chance)", count=pair.measure)
    return f"{who}: {'; '.join(gettext(SIGNS[sign]) for sign in pair.why)}{chance or ''}"


def _who(student: str, position: int | None) -> str:
    return student if position is None else f"{student}, {gettext('position')} {position}"
