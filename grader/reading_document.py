"""What was read on a page, as a JSON document."""

from grader.documents import (
    FigureDocument,
    NodeDocument,
    ProblemDocument,
    ReadingDocument,
    SheetDocument,
    TimingDocument,
    UnreadDocument,
    VectorDocument,
)
from grader.records import Figure, Problem, Reading, ReadNode, ReadVector, Sheet

STAGES = ("decode", "sheet", "ink", "reading")


def reading_document(
    source: str,
    page: int,
    student_id: str | None,
    sheet: Sheet | None,
    reading: Reading,
    timing_ms: dict[str, float],
) -> ReadingDocument:
    """The document of one page; `timing_ms` by stage."""
    timing = {stage: timing_ms.get(stage, 0.0) for stage in STAGES}
    sheet_problems = () if sheet is None else sheet.problems
    return ReadingDocument(
        source=source,
        page=page,
        student_id=student_id,
        sheet=None if sheet is None else _sheet(sheet),
        figures={name: _figure(figure) for name, figure in reading.figures.items()},
        unread=[UnreadDocument(name=one.name, reason=one.reason) for one in reading.unread],
        problems=[problem_document(problem) for problem in (*sheet_problems, *reading.problems)],
        timing_ms=TimingDocument(**timing, total=sum(timing.values())),
    )


def problem_document(problem: Problem) -> ProblemDocument:
    """A problem as a document."""
    return ProblemDocument(code=problem.code, message=problem.message, file=problem.file)


def _sheet(sheet: Sheet) -> SheetDocument:
    return SheetDocument(
        method=sheet.method,
        px_per_mm=sheet.px_per_mm,
        rotation_deg=sheet.rotation_deg,
        residual_mm=sheet.residual_mm,
        mm_to_px=(sheet.mm_to_px if sheet.lens is None else sheet.lens.stored).tolist(),
    )


def _figure(figure: Figure) -> FigureDocument:
    return FigureDocument(
        nodes={name: _node(node) for name, node in figure.nodes.items()},
        vectors={name: _vector(vector) for name, vector in figure.vectors.items()},
    )


def _node(node: ReadNode) -> NodeDocument:
    return NodeDocument(x_mm=node.at.real, y_mm=-node.at.imag, se_mm=node.se_mm, confidence=node.confidence)


def _vector(vector: ReadVector) -> VectorDocument:
    return VectorDocument(
        length_mm=vector.length_mm,
        se_mm=vector.se_mm,
        direction_deg=vector.direction_deg,
        se_deg=vector.se_deg,
        confidence=vector.confidence,
    )
