"""Texts that are made to harm, wherever people write: on every page and in every table they are text."""

import csv
import io
import re
from html.parser import HTMLParser
from pathlib import Path

import pikepdf
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pypdfium2 import PdfDocument

from grader.files import guarded, is_formula, unguarded
from grader.owners.draft_roster import RosterDraft, draft_csv
from grader.tables.roster import read_roster
from reference.authored.assignment import library
from tests.inline import planmark

ROOT = Path(__file__).parents[2]
MARKUP = "\"'><img src=x onerror=harm()><script>harm()</script></script><svg onload=harm()>"
NAME = f"=cmd|' /C calc'!A0{MARKUP}"
FORMULAS = ["=1+1", "+1", "-1", "@SUM(A1)", " =1", "\ufeff=1", "＝1+1"]
PDF_MARKUP = "<a href='http://evil.example'>Ana</a> <img src='/etc/passwd'/> (a\\) \u202eJohn & <b>"
WRITERS = {
    "grader/authoring/variant_table.py", "grader/cli/checking.py", "grader/cycle/quantities.py",
    "grader/folder/collect.py", "grader/owners/draft_roster.py", "grader/tables/decisions.py",
    "grader/lms/table.py", "grader/tables/reader.py",
}  # fmt: skip
"""The files that write tables: by a writer of their own, or by that of `grader/tables/reader.py`."""
WRITES = re.compile(r"csv\.writer\(|from grader\.tables\.reader import[^.]*\bwritten\b")


class Page(HTMLParser):
    """Everything that a page would run, fetch or lead to."""

    def __init__(self, text):
        super().__init__()
        self.harm, self.scripts = [], []
        self.is_script = False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.is_script = tag == "script"
        for name, value in attrs:
            leads = name in {"src", "href", "xlink:href", "action"} and re.match(
                r"\s*(javascript|https?|//|data:text)", value or "", re.IGNORECASE
            )
            if name.startswith("on") or name == "srcdoc" or leads:
                self.harm.append((tag, name, value))
        if tag in {"iframe", "object", "embed", "base", "foreignobject"}:
            self.harm.append((tag,))

    def handle_data(self, data):
        if self.is_script and "harm()" in re.sub(r"\\u003c.*", "", data):
            self.harm.append(("script", data[:80]))
        self.is_script = False


def quoted(text):
    return f'"{text.replace(chr(34), chr(34) * 2)}"'


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The folder of a class in which everybody writes such texts, graded; what the program printed."""
    top = tmp_path_factory.mktemp("texts")
    folder, out = top / "class", top / "out"
    folder.mkdir()
    escaped = MARKUP.replace("\\", "\\\\").replace('"', '\\"')
    for kind in ("assignment", "mechanism", "rubric"):
        text = (library() / f"pump.{kind}.toml").read_text(encoding="utf-8")
        text = re.sub(r'^((?:en|ro|ru|label|title) = )".*"', rf'\1"={escaped}"', text, flags=re.MULTILINE)
        (top / f"pump.{kind}.toml").write_text(text, encoding="utf-8")
    (folder / "roster.csv").write_text(
        f"student_id,name,n,email\ns1,{quoted(NAME)},7,{quoted('=1' + MARKUP)}\ns2,{quoted(PDF_MARKUP)},8,\n",
        encoding="utf-8",
    )
    (folder / "s1.csv").write_text(
        f"n,v_A,kL,{MARKUP.replace(',', '')}\n7,60,{quoted(MARKUP)},{quoted(NAME)}\n", encoding="utf-8"
    )
    for name in (
        "s2_<img src=x onerror=harm()>\x1b[31m\u202e.jpg",
        "nobody <svg onload=harm()>.png",
        "=1+1.jpg",
    ):
        (folder / name).write_bytes(b"\xff\xd8\xff junk")
    (folder / "decisions.csv").write_text(
        "student_id,position,criterion,verdict,points,comment,by,at,basis\n"
        f"s1,,v_A,none,0,{quoted(NAME)},{quoted(NAME)},2026-11-22T18:00:00+02:00,\n",
        encoding="utf-8",
    )
    options = ["--assignment", top / "pump.assignment.toml", "--roster", folder / "roster.csv"]
    log = top / "log.txt"
    graded = planmark("grade", folder, *options, "--out", out, "--log", log, cwd=top)
    assert graded.returncode == 1, graded.stderr
    draft = draft_csv(read_roster(folder / "roster.csv"), RosterDraft(()))
    (top / "draft.csv").write_text(draft, encoding="utf-8")
    for kind in ("sheet", "handout"):
        words = [kind, options[1], "--roster", options[3], "--out", top / f"{kind}.pdf"]
        assert planmark(*words, cwd=top).returncode in {0, 1}
    for platform in ("csv", "moodle", "canvas", "gradescope"):
        words = ["export", out, "--to", platform, "--file", top / f"{platform}.csv", "--roster", options[3]]
        planmark(*words, cwd=top)
    return top, graded.stdout + graded.stderr, log


def test_a_page_runs_and_fetches_nothing_that_people_wrote(written):
    pages = [*written[0].rglob("*.html"), *written[0].rglob("*.svg")]
    assert len(pages) >= 3
    for path in pages:
        text = path.read_text(encoding="utf-8")
        assert not Page(text).harm, path
        assert "<script>harm" not in text, path
        assert "\u202e" not in text, path
    assert "harm()" in (written[0] / "out" / "index.html").read_text(encoding="utf-8"), "it is shown as text"


def test_a_table_has_no_formula(written):
    tables = [path for path in written[0].rglob("*.csv") if "class" not in path.parts]
    assert {"summary.csv", "draft.csv", "csv.csv"} <= {path.name for path in tables}
    for path in tables:
        for row in csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"), newline="")):
            for cell in row:
                assert not is_formula(cell) or re.fullmatch(r"'+.*|-?[\d.]+", cell, re.DOTALL), (
                    path.name,
                    cell,
                )


def test_every_writer_of_tables_guards_texts():
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "grader").rglob("*.py")
        if WRITES.search(path.read_text(encoding="utf-8"))
    }
    assert found == WRITERS
    for name in WRITERS - {"grader/cli/checking.py", "grader/tables/reader.py"}:
        assert "guarded" in (ROOT / name).read_text(encoding="utf-8"), name


@given(st.one_of(st.sampled_from(FORMULAS), st.text(), st.text(alphabet="'=+-@ \t\r\n1")))
def test_a_guarded_text_is_no_formula_and_reads_back(text):
    assert unguarded(guarded(text)) == text
    assert guarded(text).startswith("'") or not is_formula(text)


def test_a_printed_page_has_no_link_and_no_file_of_the_machine(written):
    for name in ("sheet.pdf", "handout.pdf"):
        path = written[0] / name
        with pikepdf.open(path) as pdf:
            assert not [page for page in pdf.pages if "/Annots" in page]
            assert "/OpenAction" not in pdf.Root
            assert "/AA" not in pdf.Root
        text = "".join(page.get_textpage().get_text_bounded() for page in PdfDocument(path))
        assert "Ana" in text, name
        assert "root:" not in text


def test_a_terminal_obeys_no_name(written):
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e]", written[1])
    assert "\\x1b[31m" in written[1]


def test_a_line_of_the_log_is_an_entry_or_indented(written):
    for line in written[2].read_text(encoding="utf-8").splitlines():
        assert re.match(r"\d{4}-\d\d-\d\d |    ", line), line
