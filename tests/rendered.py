"""Pages of a PDF as a scanner would see them, without its faults."""

import numpy as np
import pypdfium2

from grader.records import GreyImage


def rendered(pdf: bytes, dpi: float, page: int = 0) -> GreyImage:
    """(h, w) grey of a page, counted from 0."""
    with pypdfium2.PdfDocument(pdf) as document:
        image = document[page].render(scale=dpi / 72, grayscale=True).to_numpy()
        return np.ascontiguousarray(image.reshape(image.shape[:2]))
