"""Write the page licences.md from the metadata of what is installed: `python -m docs.make_licences`.

A package is listed once, where it is first needed: by planmark itself, then by each of its extras. What only
tests, the documentation or developers need is not: nothing of it reaches a user.
"""

import importlib.metadata
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement

PAGE = Path(__file__).resolve().parent / "licences.md"
EXTRAS = ("", "heic", "web", "cluster", "plots")
_CLASSIFIER = re.compile(r"License ::(?: OSI Approved ::)? (.+)")
_LONGEST = 60
"""Longest name of a licence; some packages have the whole text there."""
BOUND = {
    "LGPL": "any program may use it whose users can exchange it for another version: it is installed apart"
    ", as it is. Whoever passes on a changed copy passes on its source, too",
    "MPL": "any program may use it. Whoever passes on changed files of it passes on their source, too",
}
HEAD = """# Licences

planmark is under the MIT licence. What it is installed with has licences of its own; this page is written by
`python -m docs.make_licences` from the metadata of the packages. None is copied into planmark. Packages with
compiled parts carry libraries of others, whose licences lie beside them once they are installed: FFmpeg in
`opencv-python-headless` is under the LGPL, too.

`constraints/web.txt` and `constraints/cluster.txt` have the version of each and the hashes of its files;
`nox -s constraints` writes them anew. `nox -s sbom` makes bills of materials of them (CycloneDX).
"""


@dataclass(frozen=True, slots=True)
class Package:
    """A package: its name, its licence, and the extra that first needs it, empty for planmark itself."""

    name: str
    licence: str
    extra: str


def licence_of(name: str) -> str:
    """The licence that a package's metadata name; empty where they name none."""
    metadata = importlib.metadata.metadata(name)
    said = metadata.get("License-Expression") or ""
    text = (metadata.get("License") or "").strip()
    named = [found[1] for one in metadata.get_all("Classifier") or () if (found := _CLASSIFIER.match(one))]
    short = text if text and "\n" not in text and len(text) <= _LONGEST and text.lower() != "unknown" else ""
    return said or "; ".join(named) or short


def packages() -> list[Package]:
    """All that planmark and its extras need, here and now, each once."""
    found: dict[str, Package] = {}
    for extra in EXTRAS:
        for name in _needed("planmark", extra, {}):
            found.setdefault(_plain(name), Package(name, licence_of(name), extra))
    return list(found.values())


def _needed(name: str, extra: str, seen: dict[tuple[str, str], None]) -> Iterator[str]:
    """The packages that one needs for an extra, and those that these need."""
    if (_plain(name), extra) in seen:
        return
    seen[_plain(name), extra] = None
    for line in importlib.metadata.requires(name) or ():
        one = Requirement(line)
        if one.marker is not None and not one.marker.evaluate({"extra": extra}):
            continue
        yield importlib.metadata.metadata(one.name)["Name"]
        for inner in ("", *sorted(one.extras)):
            yield from _needed(one.name, inner, seen)


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def page() -> str:
    """The page."""
    parts, known = [HEAD], packages()
    for extra in EXTRAS:
        title = f"The extra `{extra}`" if extra else "planmark itself"
        rows = sorted((one for one in known if one.extra == extra), key=lambda one: one.name.lower())
        table = [f"| {one.name} | {one.licence} |" for one in rows]
        parts.append("\n".join([f"## {title}\n", "| package | licence |", "|---|---|", *table]) + "\n")
    told = [
        f"- **{kind}**: {', '.join(f'`{one.name}`' for one in known if kind in one.licence)}: {why}."
        for kind, why in BOUND.items()
        if any(kind in one.licence for one in known)
    ]
    parts.insert(1, "## What asks for more than its notice\n\n" + "\n".join(told) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
