"""A page of small pictures of all scans, to see at a glance whose is whose."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import simplejpeg

from grader.i18n import N_, Tongue, tongue
from grader.matching import Suggestion
from grader.pixels import shrink
from grader.records import GreyImage

_THUMBNAIL_PX = 640
_QUALITY = 60

_STYLE = """
body{font:15px/1.35 system-ui,sans-serif;margin:1.5rem;color:#222;background:#fafafa}
main{display:grid;grid-template-columns:repeat(auto-fill,minmax(22rem,1fr));gap:1rem}
figure{margin:0;padding:.6rem;background:#fff;border:1px solid #ccc;border-left:.5rem solid #c47f00}
figure.sure{border-left-color:#2a7d2a}
img{width:100%;height:auto;display:block}
figcaption b{font-size:1.1em}
"""


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """A page's small picture, JPEG."""

    jpeg: bytes


def thumbnail(grey: GreyImage, quarter_turns: int = 0) -> Thumbnail:
    """The page reduced, turned counter-clockwise by quarters."""
    small = np.rot90(shrink(grey, min(1.0, _THUMBNAIL_PX / max(grey.shape))), quarter_turns)
    image = np.ascontiguousarray(small)[:, :, None]
    return Thumbnail(simplejpeg.encode_jpeg(image, quality=_QUALITY, colorspace="GRAY"))


def contact_sheet(entries: Sequence[tuple[Suggestion, Thumbnail]], lang: str = "en") -> str:
    """A self-contained HTML page: every page's picture, its file, the student suggested, and why."""
    words = tongue(lang)
    title = escape(words.gettext(N_("Whose page is whose")))
    advice = escape(
        words.gettext(
            N_("Check the pages with an orange edge, correct the draft, and hand it in as the roster.")
        )
    )
    figures = "\n".join(_figure(suggestion, picture, words) for suggestion, picture in entries)
    return (
        f'<!doctype html>\n<html lang="{words.lang}"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style></head>\n<body><h1>{title}</h1><p>{advice}</p>\n<main>\n{figures}\n</main></body></html>\n"
    )


def _figure(suggestion: Suggestion, picture: Thumbnail, words: Tongue) -> str:
    image = base64.b64encode(picture.jpeg).decode("ascii")
    row = suggestion.row
    if row is None:
        who = words.gettext(N_("nobody is suggested"))
    else:
        variant = [
            f"{label} = {value}"
            for label, value in (("n", row.n), (words.gettext(N_("position")), row.position))
            if value is not None
        ]
        who = ", ".join([row.student_id, row.name, *variant])
    kind = "sure" if suggestion.sure else "check"
    source = escape(str(suggestion.source))
    return (
        f'<figure class="{kind}"><img alt="{source}" src="data:image/jpeg;base64,{image}">'
        f"<figcaption><b>{escape(who)}</b><br>{source}<br><small>{escape(suggestion.why)}</small></figcaption></figure>"
    )
