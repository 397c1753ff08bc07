"""What was read on a page, as a JSON document."""

from grader.documents import ReadingDocument
from grader.records import Figure, ScannedPage, Sheet

STAGES = ("decode", "sheet", "ink", "reading")


def reading_document(page: ScannedPage, student_id: str | None) -> ReadingDocument:
    """The document of one page."""
    timing = {stage: page.timing_ms.get(stage, 0.0) for stage in STAGES}
    of_sheet = () if page.sheet is None else page.sheet.problems
    return ReadingDocument.model_validate(
        {
            "source": page.ref.file,
            "page": page.ref.page,
            "student_id": student_id,
            "sheet": None if page.sheet is None else _sheet(page.sheet),
            "figures": {name: _figure(figure) for name, figure in page.reading.figures.items()},
            "unread": page.reading.unread,
            "problems": (*of_sheet, *page.problems, *page.reading.problems),
            "timing_ms": {**timing, "total": sum(timing.values())},
        }
    )


def _sheet(sheet: Sheet) -> dict[str, object]:
    stored = sheet.mm_to_px if sheet.lens is None else sheet.lens.stored
    fields = {name: getattr(sheet, name) for name in ("method", "px_per_mm", "rotation_deg", "residual_mm")}
    return {**fields, "mm_to_px": stored.tolist()}


def _figure(figure: Figure) -> dict[str, object]:
    nodes = {
        name: {
            "x_mm": node.at.real,
            "y_mm": -node.at.imag,
            "se_mm": node.se_mm,
            "confidence": node.confidence,
        }
        for name, node in figure.nodes.items()
    }
    return {"nodes": nodes, "vectors": figure.vectors}
