"""The cost of rendering a PDF page, counted before any pixel is made."""

import io
import math
import zlib
from collections import Counter
from dataclasses import dataclass, field
from typing import cast

import numpy as np
import pikepdf
from PIL import Image

from grader.records import GreyImage
from grader.scan.decode import pictures
from grader.scan.decode.limits import InputFile, check_memory, damaged
from grader.scan.decode.tiff import Coding, damaged_row
from reference.errors import InputFileError

MAX_CONTENT = 32_000_000
"""Bytes of drawing commands on a page, each as often as it is carried out; exported drawings have 5 MB."""
_OPERATORS = "Do gs scn SCN sh Tf Tj TJ ' \" BI ID EI"
SHOWS_TEXT = frozenset(("Tj", "TJ", "'", '"'))
_PIXELS_A_BYTE = 64
"""Pixels of an image that take as long as one byte of drawing commands."""
_GROUP_PIXELS_A_BYTE = 24
"""Pixels of the page, which each transparency group takes a picture of: 0.3 s for A3 at 300 dpi."""
_RENDERED_PIXELS_A_POINT = (300.0 / 72.0) ** 2
_SHADED_PIXELS_A_BYTE = {2: 48.0, 3: 12.0}
"""Pixels that an axial and a radial shading fill in the time of one byte: A3 takes 0.15 and 0.64 s."""
_FUNCTION_BYTES, _FUNCTION_BYTES_A_BYTE, _SHADES = 50, 450, 256
"""What calling a function takes, in bytes of its program; bytes carried out in the time of one byte of
commands; colours that a shading along a line has. A shading over a plane calls for each pixel."""
_MESH_BYTES_A_BYTE = 1000
"""Of a mesh's data, as each of its patches may cover the page: 4 KB on A4."""
_DEEPEST_FUNCTION = 8
"""Functions made of functions."""
_PAINTS = "f F f* B B* b b* S s"
_MAX_TILES = 1_000_000
"""Tiles of a pattern on a page: A3 in millimetre squares has 125,000."""
_SLACK = 1 << 16
"""Bytes behind the last row that writers may leave."""
_PLANES = {"/DeviceRGB": 3, "/CalRGB": 3, "/Lab": 3, "/DeviceCMYK": 4}
_BYTES_A_PLANE = {"/JPXDecode": 8}
"""Working memory for a pixel in one plane, where it is more than the pixel: JPEG 2000 works on tiles."""


@dataclass(slots=True)
class PageContent:
    """What carrying out a page's commands would draw.

    Attributes
    ----------
    objects : number of forms and images that the page's own commands draw
    images : each image drawn, by its object number and generation
    damage : first and last damaged row of the first fax image that has some; empty where none has
    """

    objects: int = 0
    images: dict[tuple[int, int], pikepdf.Stream] = field(default_factory=dict)
    damage: tuple[int, ...] = ()


def drawn_by(file: InputFile, number: int, page: pikepdf.Page) -> PageContent:
    """What a page draws; raises InputFileError for more than a drawing can have."""
    walk = _ContentWalk(file, number, page)
    contents = page.obj.get("/Contents")
    streams = list(contents) if isinstance(contents, pikepdf.Array) else [contents] if contents else []
    left = MAX_CONTENT
    for stream in streams:
        if not isinstance(stream, pikepdf.Stream):
            raise InputFileError(
                "pdf_damaged",
                f"{file.name}, page {number}: its drawing commands are missing; export it again",
            )
        left -= walk.size(stream, left)
    uses = walk.uses(page)
    walk.drawn.objects = sum(count for (operator, _), count in uses.items() if operator == "Do")
    cost = MAX_CONTENT - left + walk.cost(uses, walk.resources)
    for annotation in page.obj.get("/Annots", ()):
        cost += sum(walk.of_stream(stream, None) for stream in _appearances(annotation))
    walk.check(cost)
    return walk.drawn


def _area(box: pikepdf.Array) -> float:
    left, bottom, right, top = (float(value) for value in box)
    return (right - left) * (top - bottom)


def _appearances(annotation: pikepdf.Object) -> list[pikepdf.Stream]:
    """The normal appearance of an annotation: a stream, or one for each state."""
    if not isinstance(annotation, pikepdf.Dictionary):
        return []
    normal = annotation.get("/AP", pikepdf.Dictionary()).get("/N")
    states = list(normal.values()) if isinstance(normal, pikepdf.Dictionary) else [normal]
    return [state for state in states if isinstance(state, pikepdf.Stream)]


class _ContentWalk:
    """Follows the streams of one page; each is parsed once."""

    def __init__(self, file: InputFile, number: int, page: pikepdf.Page) -> None:
        self.file, self.number = file, number
        self.area = abs(_area(page.mediabox))
        self.resources = page.obj.get("/Resources")
        self.drawn = PageContent()
        self.costs: dict[tuple[int, int], float] = {}
        self.open: set[tuple[int, int]] = set()

    def check(self, cost: float) -> None:
        """Raise InputFileError for more commands than a drawing has."""
        if cost > MAX_CONTENT:
            raise InputFileError(
                "pdf_too_heavy",
                f"{self.file.name}, page {self.number}: it takes longer to draw than"
                f" {MAX_CONTENT // 1_000_000} MB of lines; export the page as an image (PNG, 300 dpi)",
            )

    def size(self, stream: pikepdf.Stream, most: int) -> int:
        """Bytes of commands in a stream; raises where they are more than `most`."""
        known = unpacked(stream, most)
        size = len(known) if known is not None else len(stream.read_bytes())
        if size > most:
            self.check(math.inf)
        return size

    def of_stream(self, stream: pikepdf.Stream, resources: pikepdf.Object | None) -> float:
        """Cost of carrying out a form, pattern or letter once; `resources` where it has none of its own."""
        key = stream.objgen
        if key in self.open or stream.get("/Type") == pikepdf.Name.Page:
            self.check(math.inf)  # it draws itself, or hides its commands from qpdf
        if key not in self.costs:
            self.open.add(key)
            size = self.size(stream, MAX_CONTENT)
            own = stream.get("/Resources", resources)
            self.costs[key] = size + self.cost(self.uses(stream), own)
            if "/Group" in stream:
                self.costs[key] += self.area * _RENDERED_PIXELS_A_POINT / _GROUP_PIXELS_A_BYTE
            self.open.remove(key)
            self.check(self.costs[key])
        return self.costs[key]

    def uses(self, holder: pikepdf.Page | pikepdf.Stream) -> Counter[tuple[str, str]]:
        """How often each operator names each resource; letters shown count by their number."""
        uses: Counter[tuple[str, str]] = Counter()
        for instruction in pikepdf.parse_content_stream(holder, _OPERATORS):
            operator, operands = str(instruction.operator), instruction.operands
            if operator in SHOWS_TEXT:
                uses["letters", ""] += sum(_letters(operand) for operand in operands)
            elif operator == "INLINE IMAGE":
                image = operands[0]
                uses["pixels", ""] += int(image.width) * int(image.height)
            elif operands and isinstance(operands[0 if operator == "Tf" else -1], pikepdf.Name):
                uses[operator, str(operands[0 if operator == "Tf" else -1])] += 1
        if any(operator in {"scn", "SCN"} for operator, _ in uses):
            uses["paints", ""] = len(pikepdf.parse_content_stream(holder, _PAINTS))
        return uses

    def cost(self, uses: Counter[tuple[str, str]], resources: pikepdf.Object | None) -> float:
        """Cost of what a stream names in its resources."""
        total, letter, paint = uses["pixels", ""] / _PIXELS_A_BYTE, 0.0, 0.0
        groups = {"Do": "/XObject", "gs": "/ExtGState", "Tf": "/Font", "sh": "/Shading"}
        for (operator, name), count in uses.items():
            resource = self.named(groups.get(operator, "/Pattern"), name, resources)
            if operator == "sh" and resource is not None:
                total += count * self.shading(resource)
            elif operator in {"scn", "SCN"} and isinstance(resource, pikepdf.Dictionary):
                # All that is painted may be painted with it.
                paint = max(paint, self.shading(resource.get("/Shading")))
            elif isinstance(resource, pikepdf.Stream) and resource.get("/Subtype") == "/Image":
                total += count * self.image(resource)
            elif isinstance(resource, pikepdf.Stream):
                self.check_tiles(resource)
                total += count * self.of_stream(resource, resources)
            elif operator == "gs" and resource is not None:
                mask = resource.get("/SMask")
                if isinstance(mask, pikepdf.Dictionary) and isinstance(mask.get("/G"), pikepdf.Stream):
                    total += count * self.of_stream(cast("pikepdf.Stream", mask.G), resources)
            elif operator == "Tf" and resource is not None and resource.get("/Subtype") == "/Type3":
                letters = (form for form in resource.CharProcs.values() if isinstance(form, pikepdf.Stream))
                own = resource.get("/Resources", resources)
                letter = max([letter, *(self.of_stream(form, own) for form in letters)])
            self.check(total)
        return total + uses["letters", ""] * (letter + paint) + uses["paints", ""] * paint

    def shading(self, shading: pikepdf.Object | None) -> float:
        """Cost of filling the page with a shading once."""
        if not isinstance(shading, pikepdf.Dictionary | pikepdf.Stream):
            return 0.0
        kind, pixels = int(shading.get("/ShadingType", 0)), self.area * _RENDERED_PIXELS_A_POINT
        if isinstance(shading, pikepdf.Stream):
            return pixels * self.size(shading, MAX_CONTENT) / _MESH_BYTES_A_BYTE
        calls = _SHADES if kind in _SHADED_PIXELS_A_BYTE else pixels
        program = _FUNCTION_BYTES + self.program(shading.get("/Function"))
        fill = pixels / _SHADED_PIXELS_A_BYTE.get(kind, math.inf)
        return fill + calls * program / _FUNCTION_BYTES_A_BYTE

    def program(self, function: pikepdf.Object | None, deep: int = 0) -> float:
        """Bytes of the programs that a function consists of."""
        if deep > _DEEPEST_FUNCTION:
            self.check(math.inf)
        if isinstance(function, pikepdf.Stream):
            return self.size(function, MAX_CONTENT)
        parts = function.get("/Functions") if isinstance(function, pikepdf.Dictionary) else function
        inner = list(parts) if isinstance(parts, pikepdf.Array) else []
        return sum(_FUNCTION_BYTES + self.program(part, deep + 1) for part in inner)

    def named(self, group: str, name: str, resources: pikepdf.Object | None) -> pikepdf.Object | None:
        """What a name stands for; as in pdfium, among the page's resources where a form's own lack it."""
        for known in (resources, self.resources):
            kind = known.get(group) if isinstance(known, pikepdf.Dictionary) else None
            if isinstance(kind, pikepdf.Dictionary) and name in kind:
                return kind[name]
        return None

    def check_tiles(self, stream: pikepdf.Stream) -> None:
        """Raise InputFileError for a pattern of more tiles than a page can show."""
        if "/XStep" not in stream:
            return
        matrix = stream.get("/Matrix", pikepdf.Array([1, 0, 0, 1, 0, 0]))
        a, b, c, d = (float(value) for value in list(matrix)[:4])
        tile = abs(float(stream.XStep) * float(stream.get("/YStep", 0)) * (a * d - b * c))
        if tile * _MAX_TILES < self.area:
            self.check(math.inf)

    def image(self, stream: pikepdf.Stream) -> float:
        """Cost of drawing an image; raises InputFileError for one that a sheet cannot need."""
        width, height = int(stream.Width), int(stream.Height)
        if stream.objgen not in self.drawn.images:
            self.drawn.images[stream.objgen] = stream
            _check_image(self.file, self.number, stream, width, height)
            row = _fax_damage(stream, height)
            if row is not None and not self.drawn.damage:
                self.drawn.damage = (row + 1, height)
            if isinstance(stream.get("/SMask"), pikepdf.Stream):
                self.image(cast("pikepdf.Stream", stream.SMask))
        return width * height / _PIXELS_A_BYTE


def _letters(operand: pikepdf.Object) -> int:
    if isinstance(operand, pikepdf.Array):
        return sum(_letters(part) for part in operand)
    return len(bytes(operand)) if isinstance(operand, pikepdf.String) else 0


def _check_image(file: InputFile, number: int, stream: pikepdf.Stream, width: int, height: int) -> None:
    """Raise InputFileError for an image that needs too much memory, by all that tells its size."""
    filters = filters_of(stream)
    bits = int(stream.get("/BitsPerComponent", 8))
    planes = _PLANES.get(str(stream.get("/ColorSpace")), 1)
    plane_bytes = max([bits / 8, *(_BYTES_A_PLANE.get(name, 0) for name in filters)])
    check_memory(file, number, width * height, int(width * height * planes * plane_bytes))
    if filters == ["/DCTDecode"]:
        pictures.check_header(file, number, stream.read_raw_bytes(), least=False)
    elif filters == ["/JPXDecode"]:
        with Image.open(io.BytesIO(stream.read_raw_bytes())) as image:
            planes = len(image.getbands())
            pixels = image.width * image.height
        check_memory(file, number, pixels, pixels * planes * _BYTES_A_PLANE["/JPXDecode"])
    elif filters and set(filters) == {"/FlateDecode"}:
        most = height * (width * planes * bits // 8 + 2) * (1 if planes > 1 else 4) + _SLACK
        data = unpacked(stream, most)
        if data is not None and len(data) > most:
            raise damaged(file, number, "its data are more than its size asks for")


def _fax_damage(stream: pikepdf.Stream, height: int) -> int | None:
    """The first damaged row of an image packed as fax, from 0; None for a whole one and for other packing."""
    filters = filters_of(stream)
    if not filters or filters[-1] != "/CCITTFaxDecode":
        return None
    data = unpacked(stream, MAX_CONTENT, filters[:-1])
    if data is None:
        return None
    parameters = stream.get("/DecodeParms", pikepdf.Dictionary())
    if isinstance(parameters, pikepdf.Array):
        parameters = parameters[len(filters) - 1]
    known = parameters if isinstance(parameters, pikepdf.Dictionary) else pikepdf.Dictionary()
    coding = Coding(int(known.get("/K", 0)), bool(known.get("/EncodedByteAlign", False)))
    return damaged_row(data, int(known.get("/Columns", 1728)), height, coding)


# Unpacking ----------------------------------------------------------------------------------------


def unpacked(stream: pikepdf.Stream, most: int, filters: list[str] | None = None) -> bytes | None:
    """A stream's bytes, at most `most` and one more; None where they are packed by more than deflation.

    The one byte more tells that there would have been more. Of `filters`, by default all, those that
    come first may be named alone. Rows that a predictor has changed stay so. Raises zlib.error.
    """
    filters = filters_of(stream) if filters is None else filters
    if any(name != "/FlateDecode" for name in filters):
        return None
    data = stream.read_raw_bytes()
    for _ in filters:
        data = zlib.decompressobj().decompress(data, most + 1)
    return data[: most + 1]


def filters_of(stream: pikepdf.Stream) -> list[str]:
    """How a stream is packed, the outermost first."""
    named = stream.get("/Filter")
    if named is None:
        return []
    if isinstance(named, pikepdf.Array):
        return [str(name) for name in named]
    return [str(named)]


def plain_pixels(file: InputFile, number: int, image: pikepdf.PdfImage) -> GreyImage | None:
    """(h, w) or (h, w, 3) pixels of an image stored by deflation alone, None for one stored otherwise.

    Raises InputFileError for one whose data are not what its size asks for.
    """
    bits, space = image.bits_per_component, str(image.colorspace)
    channels = {"/DeviceGray": 1, "/CalGray": 1, "/DeviceRGB": 3, "/CalRGB": 3}.get(space)
    if channels is None or image.indexed or bits not in {1, 8} or (bits == 1 and channels != 1):
        return None
    per_row = (image.width * channels * bits + 7) // 8
    size = per_row * image.height
    if "/DecodeParms" in image.obj:
        return None
    data = unpacked(cast("pikepdf.Stream", image.obj), size + _SLACK)
    if data is None:
        return None
    if len(data) < size:
        raise damaged(file, number, "its data end before its last row")
    if len(data) > size + _SLACK:
        raise damaged(file, number, "its data are more than its size asks for")
    rows = np.frombuffer(data, np.uint8, size).reshape(image.height, per_row)
    if bits == 1:
        return np.unpackbits(rows, axis=1)[:, : image.width] * np.uint8(255)
    return rows if channels == 1 else rows.reshape(image.height, image.width, channels)
