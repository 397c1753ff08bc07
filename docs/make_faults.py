"""Write the messages that authors get for broken files: a page of the site.

    python -m docs.make_faults > faults.md

`mkdocs build` puts it into the site (`site_hooks.py`). The broken files are those of
`tests/functional/broken_files.py`, each made and told when the page is written.
"""

import sys

from tests.functional.broken_files import CASES, FILES, Told, told

HEAD = """# Messages on broken files

A good course, broken in one place at a time: what was changed, and the message. Written anew with each build.
"""


def page() -> str:
    """The document: a heading for each file, a row for each case."""
    by_file: dict[str, list[Told]] = {name: [] for name in FILES}
    for one in told(CASES):
        by_file[one.case.file].append(one)
    return "\n".join([HEAD, *(_section(name, messages) for name, messages in by_file.items())])


def _section(name: str, messages: list[Told]) -> str:
    rows = [f"| {one.case.title} | {_code(_change(one))} | {_code(one.line)} |" for one in messages]
    return "\n".join(
        [f"## {name}", "", "| what is wrong | in the file | message |", "|---|---|---|", *rows, ""]
    )


def _change(one: Told) -> str:
    new = one.case.new.strip() or f"(without: {one.case.old.strip()})"
    return " ".join(new.split())[:80]


def _code(text: str) -> str:
    return f"`{text.replace('|', '/').replace('`', chr(39))}`"


if __name__ == "__main__":
    sys.stdout.write(page())
