"""Sheets that a department may give away: no names, no title blocks, no metadata; decisions are the truth.

Two steps, so that nothing leaves unseen. The first writes a preview: each page as it would be given, a page
on which to look at them, and `pages.csv` with an empty column. The second gives away the pages that say yes,
as they were seen. Pages stand in random order, under numbers. No student, date, file name or path is told.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from random import SystemRandom
from typing import Any, Literal

import numpy as np

from grader.documents import CriterionDocument, ReportDocument, SaidDocument
from grader.feedback.words import environment
from grader.files import guarded, make_folder, unguarded, write_whole
from grader.folder.batch import Batch, Graded, files_of, pages_read
from grader.folder.cache import digest_of
from grader.folder.inventory import shown_names
from grader.lms.export import write_archive
from grader.lms.grades import in_a_row
from grader.marking.trust import said_of
from grader.overlay.covered import Keep, bare_png, covered, painted, reopened, upright_pixels
from grader.records import (
    MECHANISM,
    ZONE_SLACK_MM,
    Box,
    Figure,
    FloatArray,
    Reason,
    ScannedPage,
    Sheet,
    on_sheet,
)
from grader.rubric import plans_asked
from grader.scan.decode.pages import decode
from grader.scan.handwriting.lines import find_lines
from grader.scan.pixels import TITLE_BLOCK_MM, mapped
from grader.tables.decision_texts import audit_answer
from grader.tables.reader import TableKind, check_rows, short, written
from grader.texts.spoken import failure
from reference.construction.graph import Construction
from reference.errors import CallError
from reference.plan import construction_for

PAGES, TRUTH, STATE, LOOK = "pages.csv", "truth.jsonl", "state.txt", "index.html"
COLUMNS = ("page", "give_away", "cover")
_ANSWERS = TableKind("answers_wrong", COLUMNS, COLUMNS[:2], 20_000_000, 200_000)
YES, NO = frozenset({"yes", "da", "да"}), frozenset({"no", "nu", "нет"})
USUAL_BLOCK_MM = (200.0, 70.0)
"""ISO 7200 and GOST 2.104: 180 to 185 by 55 mm at most, 10 mm from the paper's edges."""
OF_SHEET = ("page_mm", "px_per_mm", "method", "residual_mm", "scale_se", "drawable_mm", "zones")
"""Fields of a page's registration that are given away, beside `mm_to_px`."""
SCHEMA_VERSION = 1
By = Literal["moved", "audited", "decided", "program", "disputed"]
"""The authority for a point: a person put it there, found the verdict on it right, or decided as the program
had proposed; the program alone; or the program although a person found the verdict wrong."""
_RANK: Mapping[By, int] = {"program": 0, "decided": 1, "audited": 2, "disputed": 3, "moved": 4}
Row = dict[str, Any]
"""An object of JSON."""
Known = tuple[ScannedPage, Construction, Row]
"""A page, how it is constructed, and what is known of it."""


@dataclass(frozen=True, slots=True)
class Collected:
    """The outcome of a step.

    Attributes
    ----------
    preview : the folder in which pages are looked at
    given : how many pages were written; None where the preview was made, or waits for a person
    waiting : pages that a person must (again) look at
    left_out : pages that cannot be given away at all
    """

    preview: Path
    given: int | None
    waiting: tuple[str, ...] = ()
    left_out: int = 0


def preview_of(file: Path) -> Path:
    """The folder of the preview of a file."""
    return file.with_suffix(".preview")


def check_target(file: Path) -> None:
    """Raise CallError for a file that cannot be written, or a folder that is no preview."""
    if file.suffix.lower() != ".zip":
        raise failure(CallError, "not_a_zip", "ending", option="--to", file=file, names=".zip")
    if file.exists():
        raise failure(CallError, "file_exists", "file_taken", file=file)
    preview = preview_of(file)
    if preview.exists() and not (preview / STATE).is_file():
        raise failure(CallError, "file_exists", "no_preview", file=preview)


def check_scans(batch: Batch, reports: Sequence[ReportDocument]) -> None:
    """Raise CallError where scans that the results came from are no longer in their folder."""
    sources = {sheet.source for report in reports for sheet in report.reading.sheets}
    files = {re.sub(r"(\.zip)/.*", r"\1", source, flags=re.IGNORECASE) for source in sources}
    gone = sorted(files.difference(shown_names(files_of(batch), batch.base, batch.called)))
    if gone:
        raise failure(CallError, "scans_moved", folder=batch.folder, names=in_a_row(gone, 3))


# The preview --------------------------------------------------------------------------------------


def collect(batch: Batch, graded: Graded, file: Path) -> Collected:
    """Make the preview; where there is one that a person has looked at, write the file.

    Raises CallError for a preview of another state of the class, or answers that cannot be understood.
    """
    preview, known = preview_of(file), list(_known(batch, graded))
    state = digest_of([(page.ref.digest, page.ref.page, row) for page, _, row in known])
    if not known:
        raise failure(CallError, "nothing_to_give", folder=batch.folder)
    if not preview.exists():
        return _make(preview, known, state, batch.lang)
    if (preview / STATE).read_text(encoding="utf-8") != state:
        raise failure(CallError, "preview_outdated", folder=preview)
    return _give(preview, file, batch.lang)


def _make(preview: Path, known: Sequence[Known], state: str, lang: str) -> Collected:
    order = list(known)
    SystemRandom().shuffle(order)
    rows: list[Row] = []
    cells: list[tuple[str, str, str]] = []
    left_out = 0
    make_folder(preview)
    for page, construction, row in order:
        made = _anonymous(page, construction, row)
        if made is None:
            left_out += 1
            continue
        name = f"{len(rows) + 1:04}.png"
        write_whole(preview / name, made[0])
        cells.append((name, "", ""))
        rows.append({"page": name, "mm_to_px": made[1].tolist(), **row})
    write_whole(preview / TRUTH, _lines(rows))
    _ask(preview, cells, lang)
    write_whole(preview / STATE, state)
    return Collected(preview, None, tuple(name for name, *_ in cells), left_out)


def _ask(preview: Path, cells: Sequence[tuple[str, str, str]], lang: str) -> None:
    """Write the page on which a person looks, and the table of the answers so far."""
    rows = [COLUMNS, *cells]
    write_whole(preview / PAGES, written(map(guarded, row) for row in rows))
    write_whole(preview / LOOK, environment(lang).get_template("collect.html").render(pages=cells))


def _lines(rows: Sequence[Row]) -> str:
    return "".join(f"{json.dumps(row)}\n" for row in rows)


def _anonymous(page: ScannedPage, construction: Construction, row: Row) -> tuple[bytes, FloatArray] | None:
    """The picture that is left of a page, and the map from mm to its pixels; None where no figure is left."""
    sheet, keep = page.sheet, keep_of(page, construction, row)
    if sheet is None or keep is None:
        return None
    grey, mm_to_px = upright_pixels(decode(page.ref), sheet)
    return bare_png(covered(grey, mm_to_px, sheet.px_per_mm, keep)), mm_to_px


def keep_of(page: ScannedPage, construction: Construction, row: Row) -> Keep | None:
    """Return the parts of a page that stay; None if no figure was read, or one lies in the title block.

    Arguments: `row` is what is known of it; points that a person moved stay where they were and are.
    """
    if page.sheet is None or page.ink is None:
        return None
    keep = Keep(
        zones=[_slack(box) for box in page.sheet.zones.values()],
        writing=[line.box for line in find_lines(page.ink.where)],
        signs=[
            *map(_box, page.ink.marks),
            *([] if page.ink.letters is None else map(_box, page.ink.letters.box_mm)),
        ],
    )
    ends = [(one.tail, one.head) for one in construction.vectors.values()]
    ends += construction.links.values()
    for name, known in row["figures"].items():
        nodes = {node: np.array(place[:2]) for node, place in known.items()}
        read = page.reading.figures.get(name, Figure({}, {}))
        strokes = [np.array([nodes[a], nodes[b]]) for a, b in ends if a in nodes and b in nodes]
        places = [*nodes.values(), *(np.array(on_sheet(one.at)) for one in read.nodes.values())]
        if name in row["drawn"]:
            # The nodes of a polygon in another order are at no place of the sheet: its vectors are.
            strokes = [np.array(one) for one in row["drawn"][name].values()]
            before = [np.array(on_sheet(end)) for one in read.drawn.values() for end in one]
            places = [*chain.from_iterable(strokes), *before]
        if len(places) > 1:
            keep.figures.append(np.array(places))
            keep.strokes += strokes
    if not keep.figures:
        return None
    if not page.sheet.zones:
        keep.block = _title_block(page.sheet, np.concatenate(keep.figures))
    return keep if page.sheet.zones or keep.block is not None else None


def _title_block(sheet: Sheet, points: FloatArray) -> Box | None:
    """The corner in which the title block may lie, as large as figures allow; None where they lie in it."""
    wide, high = sheet.page_mm
    for size in (TITLE_BLOCK_MM, USUAL_BLOCK_MM):
        x, y = wide - size[0], high - size[1]
        if not np.any((points[:, 0] > x) & (points[:, 1] > y)):
            return x, y, *size
    return None


def _slack(box: Box) -> Box:
    x, y, wide, high = box
    return x - ZONE_SLACK_MM, y - ZONE_SLACK_MM, wide + 2 * ZONE_SLACK_MM, high + 2 * ZONE_SLACK_MM


def _box(row: FloatArray) -> Box:
    x, y, wide, high = (float(side) for side in row)
    return x, y, wide, high


# The truth ----------------------------------------------------------------------------------------


def _known(batch: Batch, graded: Graded) -> Iterator[Known]:
    """The pages with figures, each with what is known of it, in the order of the class."""
    for job, report in zip(graded.jobs, graded.results.reports, strict=True):
        variant = job.submission.variant
        if variant is None or not report.criteria:
            continue
        asked = plans_asked(batch.assignment, batch.rubric)
        construction = construction_for(batch.assignment, [variant], **asked)
        by = vouched(report, construction)
        for page, read in zip(pages_read(batch, graded.cache, job), report.reading.sheets, strict=True):
            if page.sheet is None or not read.figures:
                continue
            yield page, construction, {
                "schema_version": SCHEMA_VERSION,
                "assignment": report.assignment,
                "n": variant.n,
                "position": variant.position,
                "scales": {name: scale.used for name, scale in report.scales.items()},
                "sheet": {name: getattr(page.sheet, name) for name in OF_SHEET},
                "figures": {
                    figure: {
                        name: [round(node.x_mm, 3), round(node.y_mm, 3), by.get((figure, name), "program")]
                        for name, node in one.nodes.items()
                    }
                    for figure, one in read.figures.items()
                },
                "drawn": {figure: one.drawn for figure, one in read.figures.items() if one.drawn},
            }  # fmt: skip


def vouched(report: ReportDocument, construction: Construction) -> dict[tuple[str, str], By]:
    """Return the authority for each point, by figure and node; points that nobody checked are absent."""
    audits = {
        row.criterion[6:]: row.verdict for row in report.decisions if row.criterion.startswith("audit:")
    }
    found: dict[tuple[str, str], By] = {}
    for criterion in report.criteria:
        by = _by(criterion, said_of(report, criterion), audits.get(criterion.id))
        if by is not None:
            for place in _ends(criterion, construction):
                if _RANK[by] > _RANK[found.get(place, "program")]:
                    found[place] = by
    for row in report.decisions:
        kind, _, place_name = row.criterion.partition(":")
        if kind == "node":
            figure, _, node = place_name.partition(":")
            found[figure, node] = "moved"
    return found


def _by(criterion: CriterionDocument, said: SaidDocument | None, audit: str | None) -> By | None:
    """Return a person's opinion of the verdict that the program gave; None if nobody checked it."""
    if audit is not None and audit_answer(audit).answer != "unclear":
        return "audited" if audit_answer(audit).answer == "right" else "disputed"
    if criterion.decided is None or said is None or criterion.verdict == "not_judged":
        return None
    return "decided" if criterion.verdict == said.verdict else "disputed"


def _ends(criterion: CriterionDocument, construction: Construction) -> list[tuple[str, str]]:
    """Figure and node of both ends of what a criterion asks for, as far as it is drawn."""
    vector = construction.vectors.get(criterion.vector or "")
    if vector is not None:
        return [(construction.figure_of(vector.head), end) for end in (vector.tail, vector.head)]
    return [(MECHANISM, end) for end in construction.links.get(criterion.link or "", ())]


# What is given away -------------------------------------------------------------------------------


def _give(preview: Path, file: Path, lang: str) -> Collected:
    """Write the pages that a person looked at and said yes to."""
    rows = [json.loads(line) for line in (preview / TRUTH).read_text(encoding="utf-8").splitlines()]
    answers = read_answers(preview, [row["page"] for row in rows])
    again = tuple(name for name, (_, boxes) in answers.items() if boxes)
    for name in again:
        grey = reopened((preview / name).read_bytes())
        if grey is not None:
            write_whole(preview / name, bare_png(painted(grey, answers[name][1])))
    if again:
        rows = [_uncovered(row, answers[row["page"]][1]) for row in rows]
        write_whole(preview / TRUTH, _lines(rows))
        words = {True: "yes", False: "no", None: ""}
        cells = [(name, "" if name in again else words[said], "") for name, (said, _) in answers.items()]
        _ask(preview, cells, lang)
    waiting = again or tuple(name for name, (said, _) in answers.items() if said is None)
    if waiting:
        return Collected(preview, None, waiting)
    given = [row for row in rows if answers[row["page"]][0]]
    if not given:
        raise failure(CallError, "nothing_to_give", "no_page_given", file=preview / PAGES)
    _write_zip(preview, file, given)
    return Collected(preview, len(given))


def read_answers(preview: Path, pages: Sequence[str]) -> dict[str, tuple[bool | None, list[Box]]]:
    """Return the answer for each page: whether it is given away (None: open), and boxes to paint.

    Raises TableError with all that cannot be understood.
    """
    path = preview / PAGES
    rows = _ANSWERS.table(_ANSWERS.text(path, str(path)), str(path)).rows
    found: dict[str, tuple[bool | None, list[Box]]] = {}
    for row in rows:
        page, said, boxes = unguarded(row["page"]), row["give_away"].lower(), _boxes(row["cover"])
        if page not in pages or page in found:
            row.fault("page", Reason("no_preview_page", {"text": short(page)}))
        elif said not in {"", *YES, *NO}:
            row.fault("give_away", Reason("yes_or_no", {"text": short(said)}))
        if boxes is None:
            row.fault("cover", Reason("no_boxes"))
        found[page] = (None if not said else said in YES), boxes or []
    missing = [Reason("page_left_out", {"text": name}) for name in pages if name not in found]
    check_rows(_ANSWERS, str(path), rows, missing)
    return found


def _boxes(text: str) -> list[Box] | None:
    try:
        boxes = [tuple(float(side) for side in part.split()) for part in text.split(";") if part.strip()]
    except ValueError:
        return None
    good = all(len(box) == 4 and min(box) >= 0.0 and max(box) < 1e5 for box in boxes)
    return [(box[0], box[1], box[2], box[3]) for box in boxes] if good else None


def _uncovered(row: Row, boxes: Sequence[Box]) -> Row:
    """The truth without the points over which paper was painted."""
    mm_to_px = np.array(row["mm_to_px"])

    def is_left(x: float, y: float) -> bool:
        ((u, v),) = mapped(mm_to_px, np.array([(x, y)]))
        return not any(left <= u <= left + wide and top <= v <= top + high for left, top, wide, high in boxes)

    drawn = {
        figure: {name: ends for name, ends in vectors.items() if all(is_left(*end) for end in ends)}
        for figure, vectors in row["drawn"].items()
    }
    figures = {
        figure: {name: node for name, node in nodes.items() if is_left(node[0], node[1])}
        for figure, nodes in row["figures"].items()
    }
    for figure, vectors in drawn.items():
        # The nodes of a polygon in another order follow from all its vectors.
        is_whole = vectors == row["drawn"][figure]
        figures[figure] = row["figures"][figure] if is_whole else {}
    return {**row, "figures": figures, "drawn": drawn}


def _write_zip(preview: Path, file: Path, rows: Sequence[Row]) -> None:
    """Write the file: its pictures with pixels alone, its entries without a date."""
    given, content = list[Row](), dict[str, bytes]()
    for number, row in enumerate(rows, 1):
        grey = reopened((preview / row["page"]).read_bytes())
        if grey is None:
            raise failure(CallError, "answers_wrong", file=preview / row["page"])
        name = f"{number:04}.png"
        given.append({**row, "page": name})
        content[name] = bare_png(grey)
    write_archive(file, {**content, TRUTH: _lines(given).encode()})
