"""Write every text that people read, side by side in all languages: pages of the site, one for each topic.

    python -m docs.make_sentences > sentences.md

`mkdocs build` puts the pages into the site (`site_hooks.py`); the command prints all of them. Texts are in
the order of the files that hold them, each with an example: its parameters filled as a page would fill them.
A native speaker reads all of them in about half an hour.
"""

import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from babel.messages.extract import extract_from_dir
from babel.messages.frontend import parse_mapping_cfg

from grader.language import LANGUAGES, Tongue, tongue
from reference.authored.assignment import library

ROOT = Path(__file__).resolve().parent.parent
COUNTS = (1, 3, 20)
"""Numbers that take every form of a plural in all three languages."""
PLACEHOLDER = re.compile(r"%\((\w+)\)[+.\d]*[sdfg]|\{(\w+)\}")
KEYWORDS = {"_": None, "gettext": None, "N_": None, "ngettext": (1, 2)}
HEAD = """Written from the catalogues ([how to translate](translating.md)). Names and numbers are examples.
`/` separates the forms for 1, 3 and 20.
"""
TOPICS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "sentences-marks": ("Reasons of verdicts", ("grader/texts/reasons", "grader/texts/spoken")),
    "sentences-mistakes": ("Mistakes", ("grader/feedback/mistakes", "grader/feedback/redo_steps")),
    "sentences-problems": ("Problems of files and pages", ("grader/texts", "grader/tables", "grader/owners")),
    "sentences-feedback": ("Pages of students and classes", ("grader/feedback", "grader/lms")),
    "sentences-self-check": ("Self-check", ("grader/self_check", "grader/cli")),
    "sentences-review": ("Review", ("grader/review",)),
    "sentences-web": ("Web application", ("grader/web",)),
    "sentences-paper": ("Sheets, solutions and diagrams", ("grader",)),
}
"""Pages by name: the title, and the beginnings of the files whose texts it has; the first match counts."""
ASSIGNMENTS = "sentences-assignments", "Built-in assignments"

Row = tuple[str, ...]
"""A text in each of the languages."""

EXAMPLES: Mapping[str, str] = {
    "address": "https://marks.example.org", "along": "@15 cm", "across": "@4.84 cm", "on": "3",
    "angle": "@35°", "at": "b", "base": "AB", "centre": "A", "chance": "0.0004", "confidence": "62\u00a0%",
    "count": "2", "declared": "@0.04 (m/s)/mm", "degrees": "90", "direction": "perpendicular to %(link)s",
    "drawn": "@47.2 mm", "end": "b", "expected": "@1.67 m/s", "factor": "1.5", "first": "ab",
    "first_direction": "perpendicular to %(link)s", "first_length": "@30.0 mm", "fixed": "O1, O2",
    "formula": "n", "from": "o", "head": "B", "high": "5.38", "joint": "D", "judged": "39",
    "least": "@3.0 mm",
    "entered": "590", "meant": "59", "instead_of": "π·n/30", "length": "@48.1 mm",
    "line": "the line through %(tail)s and %(head)s", "link": "AB",
    "low": "0",
    "maximum": "42", "measured": "@1.91 m/s", "model": "ABC", "n": "7", "name": "v_BA", "node": "c",
    "nodes": "n_CA, n_CB", "number": "1", "of": "v_BA", "off": "@2.3 mm", "origin": "O1", "other": "BC",
    "own": "pump", "foot": "@23.0 mm",
    "crank_deg": "212", "part": "the velocity plan",
    "p": "a", "p_radius": "@60.0 mm", "points": "0.5", "position": "3", "q": "b", "q_radius": "@40.0 mm",
    "radius": "@60.0 mm", "rate": "omega_3", "ratio": "0.4", "real_x": "@0.3 m", "real_y": "@0.1 m",
    "result": "32.31", "scale": "kv",
    "se": "@0.25 mm", "second": "bc", "second_direction": "parallel to the guide of %(joint)s",
    "second_length": "@40.0 mm", "segment": "ab", "settled": "310", "slide": "v_BD", "start": "o'",
    "sum": "30", "tail": "A", "terms": "9 × 2 + 10 × 1", "text": "1:5?", "third": "C", "through": "a",
    "tolerance": "@1.0 mm", "used": "@0.036 (m/s)/mm", "vector": "a_BA_n",
    "why": "“%(said)s” has no unit, and a unit is never guessed: write it after the number", "wrong": "0.4",
    "written": "@45.0 mm", "x": "@60.0 mm", "x_direction": "@0°", "y": "@20.0 mm", "y_direction": "@90°",
    "cause": "normal component reversed", "done": "12", "minutes": "4", "open": "38", "total": "30",
    "verdict": "right", "who": "A. B.", "beyond": "@0.2 mm", "good_to": "@0.3 mm", "whose": "7",
    "instead": "v_CA", "share": "62\u00a0%", "file": "class.csv", "most": "1000", "names": "v_A, v_B",
    "pages": "12", "left": "3", "known": "moodle, canvas", "endings": ".jpg, .pdf", "field": "key_set_url",
    "where": "message_type", "fault": "Field required",
    "error": "line 3", "fields": "5", "ge": "1", "le": "65535",
    "column": "v_BB", "columns": "4", "mark": ",", "point": "O1",
    "title": "Pump mechanism, n = 30",
    "mechanism": "crank-rocker", "level": "all", "what": "n", "last": "30", "value": "31", "called": "7",
    "unfit": "14", "unit": "cm", "axis": "+y",
    "filed": "8", "areas": "lower left", "corners": "the lower left corner", "files": "38", "limit": "150",
    "become": "80", "grades": "12", "moment": "2026-11-23 20:35", "status": "503",
    "students": "30", "right": "24", "audited": "24", "unclear": "1", "student": "s07",
    "criterion": "Acceleration of B", "allowed": "3\u00a0%", "raised": "98.2\u00a0%",
    "times": "10", "vectors": "v_BA, v_CA", "letter": "A",
    "advice": "scan it again", "assignment": "pump", "assumed": "@300 dpi", "by": "AB, v_A", "claim": "s07",
    "claims": "the QR code: %(claim)s", "copy": "2\u00a0%", "each": "2", "entries": "v_A: '6O'",
    "examples": "1:5, 5 cm/cm", "exit": "-11", "figure": "the velocity plan", "fits": "80\u00a0%",
    "form": "velocity", "given": "2", "graded": "n = 7", "grey": "40", "kind": "PNG", "lengths": "40",
    "letters": "王", "long_side": "600", "longer": "1.5\u00a0%", "looks": "n = 9", "markers": "2",
    "shorter": "1.5\u00a0%", "group": "D",
    "measurements": "1:4", "millions": "400", "more": "12", "near": "s08", "numbers": "7, 9", "page": "3",
    "pitch": "@5.0 mm", "places": "a.csv, b.csv", "positions": "1, 2", "printed": "9", "read": "1:5",
    "readings": "1:5, 1:4", "rival": "2\u00a0%", "roster": "1:5", "rows": "30", "said": "0.036",
    "scan": "class.pdf#3", "scans": "400", "sign": "$", "size": "97\u00a0%", "strokes": "9000",
    "suffix": ".png", "unpacked": "1600", "values": "60 (a.csv), 65 (b.csv)", "wanted": "9",
    "row": "2", "lines": "3", "source": "class.pdf", "asked": "core_grading_get_definitions",
    "began": "2026-05-04T10:00", "byte": "17", "choices": "'Plan 1 (7)', 'Plan 2 (8)'", "combine": "best",
    "faults": "row 3: ...", "folder": "marks", "here": "10", "host": "desk", "item": "Plan",
    "option": "--item", "pid": "4711", "platform": "Canvas", "score": "7.5", "sheets": "class",
    "there": "20", "to": "moodle", "version": "3", "was": "class",
    "extra": "web", "findings": "$.reports: ...", "found": "--groups", "port": "8000", "table_row": "3",
    "versions": "python 3.12 / 3.11", "whole": "7", "worker": "tcp://desk:40001",
    "wait": "90\u00a0s",
    "bias": "-0.05", "difference": "0.21", "equal": "17",
    "force": "R_34_t = 12.3\u00a0mm",
    "carriers": "A: 1, 6; O3: 7", "now": "12", "figures": "the velocity plan", "free": "2", "links": "5",
    "calls": "3 grade", "command": "planmark plan", "direction_rms_deg": "0.05", "length_mean_mm": "0.02",
    "length_rms_mm": "0.06", "length_worst_mm": "0.15", "num": "2", "pivot": "O1", "place_rms_mm": "0.07",
    "scales": "kL = 1:5", "seconds": "30", "sine": "0.15", "site": "https://moodle.example.org",
    "skew": "0.06", "sure": "1", "travel": "44.05", "unequal": "0.12",
    "rank": "III", "sides": "left, right", "texts": "kL, kv", "types": "RRR, RRP", "variant": "n = 3",
    "waiting": "4", "zone": "EET", "wide": "@90 mm", "zone_high": "@120 mm", "zone_wide": "@180 mm",
}  # fmt: skip
"""Parameters by name: after ``@`` a number with its unit; other texts of the catalogues are translated."""
OTHERWISE: Mapping[str, Mapping[str, str]] = {
    "Draw %(first)s": {"first": "the line through %(tail)s and %(head)s", "second": "the guide of %(joint)s"},
    "The drawing gives": {"first": "@47.2 mm", "second": "@49.0 mm"},
    "%(declared)s is declared": {"expected": "@0.4 (m/s)/mm", "factor": "%(times)s times too small"},
    "No default": {"least": "80\u00a0%"},
    "this file has": {"most": "10"},
    "Hand in until": {"at": "2026-12-01 23:59:00 EET"},
    "You will see your feedback": {"at": "2026-12-05 08:00:00 EET"},
    "from %(at)s": {"at": "2026-12-05 08:00"},
    "the deadline was": {"at": "2026-12-01 23:59:00 EET"},
    "The letters": {"first": "b", "second": "c"},
    "Through %(first)s": {"first": "n_BA", "second": "o'"},
    "All of": {"at": "the velocity plan"},
    "All lengths": {"at": "kv"},
    "At %(at)s, the triangle": {"at": "c"},
    "It is turned": {"off": "@3.2°", "tolerance": "@1.5°"},
    "It is zero": {"measured": "@5.1 mm"},
    "%(at)s is not drawn": {"at": "v_BA"},
    "It is too short for": {"length": "@2.4 mm"},
    "It could not be read": {"why": "%(nodes)s, on which it depends, was not read for certain"},
    "It was read with": {"why": "%(nodes)s, on which it depends, was not read for certain"},
    "The sheet could not be placed": {"why": "only %(share)s of the sheet is in the picture"},
    "From the end of %(other)s": {"other": "F_i4"},
    "The drawing fits the assignment": {"other": "press"},
    "From the end of %(last)s": {
        "last": "F_D",
        "first": "R_0D",
        "second": "R_34_n",
        "first_direction": "perpendicular to the guide of %(joint)s",
        "second_direction": "parallel to %(link)s",
    },
    "Lay off %(force)s": {"force": "F_D = 47.0\u00a0mm", "other": "R_43"},
    "%(name)s runs": {"name": "R_D4", "other": "F_i4"},
    "%(name)s closes": {"name": "R_01"},
    "%(name)s is zero here: nothing": {"name": "F_i4"},
    "opposite to %(vector)s": {"vector": "R_34"},
    "From %(start)s": {"direction": "parallel to %(link)s, from %(tail)s towards %(head)s"},
}
"""Parameters of texts that begin so."""


# Examples -----------------------------------------------------------------------------------------


def example(text: str, speaker: Tongue, original: str) -> str:
    """A text of a language with its parameters filled; `original` is the English text, the key."""
    own = next((known for start, known in OTHERWISE.items() if original.startswith(start)), {})

    def filled(match: re.Match[str]) -> str:
        name = match[1] or match[2]
        value = own.get(name, EXAMPLES[name])
        if value.startswith("@"):
            return _with_unit(value[1:], speaker)
        if PLACEHOLDER.search(value):
            return example(speaker.gettext(value), speaker, value)
        if value.replace(".", "").isdigit():
            return value.replace(".", speaker.decimal_mark)
        return speaker.gettext(value)

    return PLACEHOLDER.sub(filled, text)


def _with_unit(text: str, speaker: Tongue) -> str:
    """``2.3 mm`` in a language's letters."""
    number, _, unit = text.partition(" ")
    number = number.replace(".", speaker.decimal_mark)
    return f"{number}\u00a0{speaker.unit(unit)}" if unit else number


def _plural(one: str, many: str, speaker: Tongue) -> str:
    told = ((count, speaker.ngettext(one, many, count)) for count in COUNTS)
    forms = (example(text.replace("%(num)d", str(count)), speaker, many) for count, text in told)
    return " / ".join(forms)


# Texts --------------------------------------------------------------------------------------------


def texts() -> dict[str, list[Row]]:
    """The texts of the program by the file that says them first, in its order, with an example each."""
    with (ROOT / "grader/locale/babel.cfg").open(encoding="utf-8") as file:
        methods, options = parse_mapping_cfg(file)
    said: set[object] = set()
    groups: dict[str, list[Row]] = {}
    messages = extract_from_dir(ROOT, methods, options, KEYWORDS, comment_tags=())
    for file_name, line, message, *_ in sorted(messages, key=lambda one: (one[0], one[1])):
        del line
        if message in said or not message:
            continue
        said.add(message)
        groups.setdefault(file_name, []).append(
            tuple(in_language(tongue(lang), message) for lang in LANGUAGES)
        )
    return groups


def in_language(speaker: Tongue, message: str | tuple[str, ...]) -> str:
    """A text of the catalogues as an example, a plural in its forms."""
    if isinstance(message, tuple):
        return _plural(message[0], message[1], speaker)
    return example(speaker.gettext(message), speaker, message)


def authored() -> dict[str, list[Row]]:
    """Titles and tasks of the built-in files, each once, by the first file that has it."""
    said: set[Row] = set()
    groups: dict[str, list[Row]] = {}
    for path in sorted(library().rglob("*.toml")):
        rows = dict.fromkeys(_translated(tomllib.loads(path.read_text(encoding="utf-8"))))
        new = [row for row in rows if row not in said]
        said.update(new)
        if new:
            groups[path.relative_to(library()).as_posix()] = new
    return groups


def _translated(value: object) -> Iterator[Row]:
    """The tables of languages in an authored file; empty where a language is not given."""
    if isinstance(value, dict):
        if isinstance(value.get("en"), str):
            yield tuple(value.get(lang, "") for lang in LANGUAGES)
            return
        value = [*value.values()]
    if isinstance(value, list):
        for one in value:
            yield from _translated(one)


# The pages ----------------------------------------------------------------------------------------


def pages() -> dict[str, str]:
    """Return the pages by their names: one for each of `TOPICS`, and one for the built-in assignments."""
    tables: dict[str, list[str]] = {name: [] for name in TOPICS}
    for file, rows in texts().items():
        name = next(name for name, (_, starts) in TOPICS.items() if file.startswith(starts))
        tables[name].append(_table(file, rows))
    tables[ASSIGNMENTS[0]] = [_table(file, rows) for file, rows in authored().items()]
    titles = {name: title for name, (title, _) in TOPICS.items()} | dict([ASSIGNMENTS])
    return {f"{name}.md": "\n".join([f"# {titles[name]}\n", HEAD, *parts]) for name, parts in tables.items()}


def _table(name: str, rows: list[Row]) -> str:
    names = " | ".join(tongue(lang).name for lang in LANGUAGES)
    lines = [f"## {name}", "", f"| {names} |", f"|{' --- |' * len(LANGUAGES)}"]
    lines += [f"| {' | '.join(map(_cell, row))} |" for row in rows]
    return "\n".join([*lines, ""])


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").replace("<", "&lt;").replace("_", "\\_").split(" ")).strip()


if __name__ == "__main__":
    sys.stdout.write("\n".join(pages().values()))
