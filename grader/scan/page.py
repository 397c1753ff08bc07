"""One page: pixels to strokes, without its owner."""

import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from hashlib import blake2b

from grader.records import PageRef, Reading, Reason, ScannedPage, Sheet, Unread, of_error
from grader.scan.decode.pages import decode, is_blank, is_writing
from grader.scan.handwriting.captions import Spotter, spotters
from grader.scan.handwriting.fields import writing, written_scales
from grader.scan.handwriting.letters import STAND_UPRIGHT, find_letters, upright_nats
from grader.scan.quality import flaws
from grader.scan.register.distortion import straighten
from grader.scan.register.registration import register
from grader.scan.strokes.ink import find_ink
from reference.errors import InputFileError

CALCULATIONS = "page_calculations"
NO_DRAWINGS = ("page_blank", CALCULATIONS)
"""Problems of pages on which nothing is to be read: no person is asked about them."""


def open_page(
    ref: PageRef, figures: Collection[str] = (), units: Mapping[str, str] | None = None
) -> ScannedPage:
    """A page decoded, registered, and its strokes found; `problems` say where the way ended.

    Arguments: of a printed sheet, only the zones of these `figures` are looked at; all of it by default.
    `units` are those of scales in its boxes that are bare numbers, by scale.
    """
    if ref.problem is not None:
        return ScannedPage(ref, problems=(ref.problem,))
    timing: dict[str, float] = {}
    try:
        with timed(timing, "decode"):
            image = decode(ref)
    except InputFileError as error:
        page = _refused(ScannedPage(ref, timing_ms=timing), of_error(error))
        return replace(page, ref=replace(ref, problem=page.problems[0]))
    image = replace(image, tilt_rad=ref.tilt_rad)
    if ref.turn_deg is not None:
        image = replace(image, turn_deg=ref.turn_deg, turn_is_sure=True)
    ref = replace(ref, content=blake2b(image.grey.tobytes(), digest_size=8).hexdigest())
    page = ScannedPage(ref, image, timing_ms=timing)
    # Rows that a decoder has filled with white are not blank.
    if not image.damage and is_blank(image):
        page = replace(page, ref=replace(ref, blank=True))
        return _refused(page, Reason("page_blank"))
    with timed(timing, "sheet"):
        sheet, identity = register(image, ref.corners_px)
        page = replace(page, ref=replace(ref, identity=identity))
        is_printed = isinstance(sheet, Sheet) and bool(sheet.zones)
        # A person who gives the corners has seen a drawing.
        if not (is_printed or image.damage or ref.corners_px) and is_writing(image):
            return _refused(page, Reason(CALCULATIONS))
        if isinstance(sheet, Sheet) and not image.damage:
            image, sheet = straighten(image, sheet)
        page = replace(page, flaws=flaws(image, sheet if isinstance(sheet, Sheet) else None))
    if image.damage:
        first, last = image.damage
        return _refused(page, Reason("image_damaged_rows", {"first": first, "last": last}))
    if not isinstance(sheet, Sheet):
        return _refused(page, sheet.reason)
    problems = tuple(replace(problem, file=ref.file) for problem in sheet.problems)
    boxes = sheet.boxes_of(figures)
    page = replace(page, image=image, sheet=sheet, problems=problems)
    with timed(timing, "ink"):
        if boxes is None or boxes:
            ink = find_ink(image, sheet, boxes)
            if isinstance(ink, Unread):
                return _refused(page, ink.reason)
            problems += tuple(replace(problem, file=ref.file) for problem in ink.problems)
            page = replace(page, ink=replace(ink, letters=find_letters(ink, boxes)), problems=problems)
        reading = Reading({}, written=written_scales(image, sheet, units))
    page = replace(page, reading=reading, narrowed=boxes is not None)
    return page if sheet.zones or image.turn_is_sure else _as_letters_stand(page)


def _as_letters_stand(page: ScannedPage) -> ScannedPage:
    """A plain page the way up that its letters stand; as it is where they do not tell."""
    if (nats := upright_nats(page.ink)) is None:
        return page
    other = page if nats > STAND_UPRIGHT else turned(page)
    if other is not page and (upright_nats(other.ink) or nats) <= nats + STAND_UPRIGHT:
        return page
    return replace(other, problems=tuple(one for one in other.problems if one.code != "upright_unsure"))


def turned(page: ScannedPage) -> ScannedPage:
    """A page opened the other way up, as letters are read upright only; itself where nothing is found so."""
    if page.turn_deg is None:
        return page
    other = open_page(replace(page.ref, turn_deg=(page.turn_deg + 180) % 360))
    return page if other.image is None or other.sheet is None else other


def _refused(page: ScannedPage, why: Reason) -> ScannedPage:
    where = {"page": page.ref.page} if page.ref.pages > 1 else {}
    return replace(page, problems=(Reason(why.code, {**where, **why.parameters}, page.ref.file),))


def writing_on(page: ScannedPage, *, closely: bool = False) -> list[Spotter]:
    """The lines of writing on a plain page; none on a printed sheet, which has boxes, and on one refused.

    Arguments: `closely` decodes the page again, if its pixels were left behind; else its ink map must do.
    """
    sheet = page.sheet
    if page.ink is None or sheet is None or sheet.zones:
        return []
    if not closely:
        return spotters(page.ink.where)
    try:
        image = page.image or straighten(decode(page.ref), sheet)[0]
    except InputFileError:
        return []
    return spotters(page.ink.where, lambda box: writing(image, sheet, box, 0.0))


@contextmanager
def timed(timing_ms: dict[str, float], stage: str) -> Iterator[None]:
    """Note how long a stage takes, milliseconds."""
    start = time.perf_counter()
    try:
        yield
    finally:
        timing_ms[stage] = 1000.0 * (time.perf_counter() - start)
