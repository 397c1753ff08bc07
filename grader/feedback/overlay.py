"""A look at a page as SVG over the scan: sharp at every size, and read out by its vectors' verdicts."""

import base64
from collections.abc import Iterator

from markupsafe import Markup

from grader.feedback.looks import Look
from grader.scene import Picture
from reference.canvas import FONTS, elements


def scan_element(picture: Picture, index: int) -> Markup:
    """The scan itself, to be shown by its name in every look at the page; empty where there is none."""
    if not picture.scan:
        return Markup("")
    width, height = picture.scene.page_mm
    kind = "png" if picture.scan.startswith(b"\x89PNG") else "jpeg"
    return Markup(
        '<image id="scan-{}" width="{}" height="{}" preserveAspectRatio="none"'
        ' href="data:image/{};base64,{}"/>'
    ).format(index, width, height, kind, base64.b64encode(picture.scan).decode("ascii"))


def svg(look: Look, picture: Picture, told: str) -> Markup:
    """A look; `told` says in words what is seen. The scan is taken from the page's `scan_element`."""
    image = Markup('<use href="#scan-{}"/>').format(look.picture) if picture.scan else Markup("")
    return Markup(
        '<svg class="sheet" viewBox="{:.1f} {:.1f} {:.1f} {:.1f}" role="img" aria-label="{}"'
        ' font-family="{}">{}<g class="marks">{}</g></svg>'
    ).format(*look.box, told, FONTS, image, Markup("").join(_layers(look)))


def _layers(look: Look) -> Iterator[Markup]:
    for layer in look.layers:
        shapes = Markup("".join(elements(layer.shapes)))  # noqa: S704 - written by the canvas
        opaque = layer.opacity == 1.0
        yield shapes if opaque else Markup('<g opacity="{:g}">{}</g>').format(layer.opacity, shapes)
