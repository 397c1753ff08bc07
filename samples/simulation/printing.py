"""Printed answer sheets as paper to draw on."""

import numpy as np
import pypdfium2

from grader.printed.layout import Layout
from samples.simulation.desk import PrintedSheet
from samples.simulation.scanner import Background

_DPI = 300.0


def printed_sheets(pdf: bytes, layout: Layout, first_page: int = 0) -> dict[str, PrintedSheet]:
    """One student's pages of a printed document, by kind, rasterised at 300 dpi.

    Arguments: `first_page` is the student's first page in the document, from 0.
    """
    document = pypdfium2.PdfDocument(pdf)
    sheets: dict[str, PrintedSheet] = {}
    for index, page in enumerate(layout.pages):
        bitmap = document[first_page + index].render(scale=_DPI / 72.0, grayscale=True)
        grey = np.array(bitmap.to_numpy(), dtype=np.uint8).reshape(bitmap.height, -1)[:, : bitmap.width]
        zones = {name: box for name, box in page.zones.items() if isinstance(box, tuple)}
        fields = page.zones.get("fields", {})
        sheets[page.kind] = PrintedSheet(
            Background(np.ascontiguousarray(grey), _DPI / 25.4),
            zones,
            dict(fields) if isinstance(fields, dict) else {},
            page.cells,
            {name: (place.cells, place.decimals, place.senses) for name, place in page.values.items()},
            page.positions,
        )
    document.close()
    return sheets
