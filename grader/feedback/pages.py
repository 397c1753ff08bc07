"""A student's pages: for the screen, self-contained and readable offline, and for the printer."""

from collections.abc import Sequence
from pathlib import Path

from grader.documents import ReportDocument
from grader.feedback.leaflet import About, Leaflet
from grader.feedback.leaflets import leaflet_of
from grader.feedback.looks import Look
from grader.feedback.overlay import scan_element, svg
from grader.feedback.sentences import Level
from grader.feedback.templating import environment
from grader.files import write_whole
from grader.i18n import tongue
from grader.scene import COLOURS, Picture

NOBODY = About()
PRINTED = "feedback.pdf"


def write_feedback(  # noqa: PLR0913 - all that the files hold
    report: ReportDocument,
    pictures: Sequence[Picture],
    out_dir: Path,
    lang: str,
    level: Level = "full",
    about: About = NOBODY,
    *,
    with_pdf: bool = False,
) -> None:
    """Write `feedback.html`, `feedback.pdf` if asked for, and `overlay.png`, ... into a folder.

    Arguments
    ---------
    report : its criteria's and mistakes' `feedback` is shown as it stands (see `criterion_feedback`)
    pictures : of its pages, in order; for entered measurements of the plans as measured
    level : `full` shows what was expected; `hint` and `symbol` do not

    Raises OutputError where a file cannot be written.
    """
    scanned = [picture for picture in pictures if picture.png]
    files = ["overlay.png" if k == 1 else f"overlay_{k}.png" for k in range(1, len(scanned) + 1)]
    for file, picture in zip(files, scanned, strict=True):
        write_whole(out_dir / file, picture.png)
    leaflet = leaflet_of(report, pictures, tongue(lang), level, about)
    write_whole(out_dir / "feedback.html", page_of(leaflet))
    if with_pdf:
        from grader.feedback.printed import pdf_of  # noqa: PLC0415 - brings the PDF writer

        write_whole(out_dir / PRINTED, pdf_of(leaflet))
    kept = {*files, *([PRINTED] if with_pdf else [])}
    for old in (*out_dir.glob("overlay*.png"), out_dir / PRINTED):
        # Of an earlier run: of pages that are no longer handed in, or at another level.
        if old.name not in kept:
            old.unlink(missing_ok=True)


def write_leaflet(
    file: Path,
    report: ReportDocument,
    pictures: Sequence[Picture],
    lang: str,
    level: Level = "full",
    about: About = NOBODY,
) -> None:
    """Write the page of one submission into one file: for the printer where its name ends in ``.pdf``."""
    leaflet = leaflet_of(report, pictures, tongue(lang), level, about)
    if file.suffix.lower() == ".pdf":
        from grader.feedback.printed import pdf_of  # noqa: PLC0415 - as above

        write_whole(file, pdf_of(leaflet))
    else:
        write_whole(file, page_of(leaflet))


def feedback_page(
    report: ReportDocument,
    pictures: Sequence[Picture],
    lang: str,
    level: Level = "full",
    about: About = NOBODY,
) -> str:
    """The page of one submission for the screen; arguments as of `write_feedback`."""
    return page_of(leaflet_of(report, pictures, tongue(lang), level, about))


def page_of(leaflet: Leaflet) -> str:
    """A leaflet as a page for the screen."""

    def drawn(look: Look) -> str:
        return svg(look, leaflet.pictures[look.picture], leaflet.told(look))

    return environment(leaflet.speaker.lang).get_template("feedback.html").render(
        leaflet=leaflet,
        scans=[scan_element(picture, index) for index, picture in enumerate(leaflet.pictures)],
        drawn=drawn,
        colours=COLOURS,
    )  # fmt: skip


__all__ = ["feedback_page", "page_of", "write_feedback", "write_leaflet"]
