"""HEIC pictures, as phones take them, by pi-heif, which comes with the extras `heic` and `web`.

The library turns and mirrors a picture as the file says. Its EXIF tag says so once more, and is not heeded.
"""

import numpy as np

from grader.records import Page
from grader.scan.decode.limits import Door, InputFile, check_size, truncated
from grader.scan.decode.pictures import to_grey
from reference.errors import InputFileError

_PIXEL_BYTES = 9
"""The planes of the decoder, the pixels made of them, and their copy: three bytes each."""
_CUT_OFF = ("end of file", "cannot read full")


def _page(file: InputFile, number: int) -> Page | None:
    if number > 1:
        return None
    try:
        from pi_heif import open_heif  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise InputFileError("heic_unreadable", file=file.name) from error
    try:
        picture = open_heif(file.data)
        wide, high = picture.size
        check_size(file, wide, high, _PIXEL_BYTES)
        # A copy: the decoder takes its memory back. Its rows may be longer than the picture.
        pixels = np.array(picture)[:, :wide]
    except (EOFError, ValueError) as error:
        if any(sign in str(error).lower() for sign in _CUT_OFF):
            raise truncated(file) from error
        raise
    return Page(file.name, 1, to_grey(np.ascontiguousarray(pixels), rgb=True), None, 0)


HEIC = Door(_page)
