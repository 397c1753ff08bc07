"""Sheets that are given away: nothing says whose they are, and nobody gives what nobody has looked at."""

import csv
import io
import json
import re
import zipfile
from itertools import chain

import cv2
import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageFont

from grader.files import samples_folder
from grader.folder.batch import Batch, graded
from grader.folder.collect import check_scans, check_target, collect, keep_of, preview_of, vouched
from grader.records import Figure, PageRef, Reading, ReadNode, ScannedPage, Sheet
from grader.rubric import rubric_of
from grader.tables.decisions import Decision, DecisionFile
from grader.tables.reader import TableError
from reference.authored.assignment import load_assignment
from reference.errors import CallError
from reference.plan import construction_for
from tests.bench.collected import points_of
from tests.inline import Inline
from tests.unit.reading.drawn import ink_of

PUMP = load_assignment("pump")
RUBRIC = rubric_of(PUMP)
NAME = "Ion-Popescu"
ID = "grupa12_popescu"
SIGNED_PX = (1775, 690)
"""The place of a signature on the scan of s02, inside its sketch."""


def silent(*_progress):
    """Nobody watches."""


def bring_up(top):
    batch = Batch(PUMP, RUBRIC, top / "in", top / "out")
    return batch, graded(batch, silent, Inline())


@pytest.fixture(scope="module")
def handed_in(tmp_path_factory):
    """Plain paper and a printed sheet, with metadata; a person moved a point and decided and checked."""
    top = tmp_path_factory.mktemp("class")
    folder = top / "in"
    folder.mkdir()
    exif = Image.Exif()
    exif[0x013B], exif[0x8298] = NAME, "by " + NAME
    for source, name in (("s02_1.jpg", f"{ID}_1.jpg"), ("s06_1.jpg", "s06_1.jpg")):
        with Image.open(samples_folder() / "pump" / source) as picture:
            if source == "s02_1.jpg":
                font = ImageFont.load_default(size=34)
                ImageDraw.Draw(picture).text(SIGNED_PX, "Popescu", "#444444", font)
            picture.save(
                folder / name,
                exif=exif,
                comment=NAME.encode(),
                quality=92,
                dpi=picture.info.get("dpi", (150, 150)),
            )
    lines = [
        f"student_id,name,n,kv,ka\n{ID},{NAME},12,0.219911 (m/s)/mm,9.67221 (m/s^2)/mm",
        f"s06,{NAME},9,,",
    ]
    (folder / "roster.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    _, run = bring_up(top)
    report = next(one for one in run.results.reports if one.student_id == ID)
    node = report.reading.sheets[0].figures["velocity_plan"].nodes["b"]
    by = ("", NAME, "2026-11-22T18:00:00+02:00")
    DecisionFile(folder / "decisions.csv").add(
        Decision(ID, None, "node:velocity_plan:b", f"{node.x_mm + 0.4:.3f},{node.y_mm:.3f}", None, *by),
        Decision(ID, None, "audit:v_A", "right; said=full", None, *by),
        Decision(ID, None, "audit:v_D", "wrong; said=full", None, *by),
    )
    return top


@pytest.fixture(scope="module")
def known(handed_in):
    return bring_up(handed_in)


@pytest.fixture
def preview(known, tmp_path):
    """The preview of a file, and what makes the file of it."""
    file = tmp_path / "given.zip"
    made = collect(*known, file)
    assert made.given is None
    return file, made


def answer(file, answers):
    """Write answers, by page or one for all, as a person does."""
    path = preview_of(file) / "pages.csv"
    rows = list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))
    cells = [
        (row["page"], *(answers if isinstance(answers, tuple) else answers[row["page"]])) for row in rows
    ]
    text = "\n".join(f"{page},{said},{cover}" for page, said, cover in cells)
    path.write_text(f"page,give_away,cover\n{text}\n", encoding="utf-8")


def everything_in(path):
    files = {one.name: one.read_bytes() for one in path.iterdir()}
    return {name: data for name, data in files.items() if name != "state.txt"}


def assert_nothing_personal(files):
    for name, data in files.items():
        told = data.lower()
        for word in (ID, NAME, "popescu", "s06", ".jpg", "2026", "/in/", "exif"):
            assert word.lower().encode() not in told, (name, word)
        if name.endswith(".png"):
            kinds = rb"(?s)....(IHDR|IDAT|IEND|tEXt|iTXt|zTXt|eXIf|iCCP|pHYs|tIME)"
            chunks = {*re.findall(kinds, data)}
            assert chunks == {b"IHDR", b"IDAT", b"IEND"}


def test_nothing_says_whose_the_pages_are(known, preview):
    file, made = preview
    assert made.waiting == ("0001.png", "0002.png")
    assert_nothing_personal(everything_in(made.preview))
    answer(file, ("yes", ""))
    assert collect(*known, file).given == 2
    with zipfile.ZipFile(file) as archive:
        files = {one.filename: archive.read(one) for one in archive.infolist()}
        assert {one.date_time[0] for one in archive.infolist()} == {1980}
    assert set(files) == {"0001.png", "0002.png", "truth.jsonl"}
    assert_nothing_personal({**files, "raw": file.read_bytes()[:200]})
    for line in files["truth.jsonl"].decode().splitlines():
        keys = set(json.loads(line))
        assert keys == {
            "page", "mm_to_px", "schema_version", "assignment", "n", "position", "scales", "sheet", "figures",
            "drawn",
        }  # fmt: skip


def test_only_figures_are_left_on_a_page(preview):
    _, made = preview
    for line in (made.preview / "truth.jsonl").read_text().splitlines():
        row = json.loads(line)
        grey = cv2.imread(str(made.preview / row["page"]), cv2.IMREAD_GRAYSCALE)
        paper = cv2.morphologyEx(grey, cv2.MORPH_CLOSE, np.ones((61, 61), np.uint8))
        y, x = np.nonzero(paper.astype(int) - grey > 40)
        places = cv2.perspectiveTransform(
            np.stack([x, y], axis=-1)[None].astype(np.float64), np.linalg.inv(np.array(row["mm_to_px"]))
        )[0]
        nodes = [np.array([node[:2] for node in one.values()]) for one in row["figures"].values()]
        low, top = (np.array([end(one, axis=0) for one in nodes]) for end in (np.min, np.max))
        is_in = (places[:, None] > low - 11.0) & (places[:, None] < top + 11.0)
        assert len(places) > 1000
        assert np.all(np.any(np.all(is_in, axis=-1), axis=-1))
        for node in np.concatenate(nodes):
            assert np.min(np.linalg.norm(places - node, axis=1)) < 1.5


def test_a_name_within_a_figure_is_painted_over(handed_in, preview):
    _, made = preview
    rows = [json.loads(line) for line in (made.preview / "truth.jsonl").read_text().splitlines()]
    row = next(one for one in rows if one["n"] == 12)
    nodes = row["figures"]["mechanism"]
    on_paper = {name: nodes[name][:2] for name in ("B", "C", "O2")}
    pixels = cv2.perspectiveTransform(np.array([list(on_paper.values())]), np.array(row["mm_to_px"]))[0]
    scan = cv2.imread(str(handed_in / "in" / f"{ID}_1.jpg"), cv2.IMREAD_GRAYSCALE)
    given = cv2.imread(str(made.preview / row["page"]), cv2.IMREAD_GRAYSCALE)
    # The page was cut to the sheet: what is beside a joint finds the shift.
    x, y = np.rint(pixels[1]).astype(int)
    piece = given[y - 25 : y + 25, x - 25 : x + 25]
    _, _, _, found = cv2.minMaxLoc(cv2.matchTemplate(scan, piece, cv2.TM_CCOEFF_NORMED))
    shift = np.array(found) - (x - 25, y - 25)
    left, top = np.array(SIGNED_PX) - shift
    assert np.min(scan[SIGNED_PX[1] : SIGNED_PX[1] + 40, SIGNED_PX[0] : SIGNED_PX[0] + 140]) < 120
    assert np.min(given[top : top + 40, left : left + 140]) > 200


def test_the_truth_says_who_vouches_for_each_point(known, preview):
    batch, run = known
    report = next(one for one in run.results.reports if one.student_id == ID)
    by = vouched(report, construction_for(batch.assignment))
    assert by["velocity_plan", "b"] == "moved"
    assert by["velocity_plan", "a"] == "audited"
    assert by["velocity_plan", "d"] == "disputed"
    assert by["velocity_plan", "o"] == "disputed"
    assert ("velocity_plan", "c") not in by
    rows = [json.loads(line) for line in (preview[1].preview / "truth.jsonl").read_text().splitlines()]
    row = next(one for one in rows if one["n"] == 12)
    x, y, who = row["figures"]["velocity_plan"]["b"]
    node = report.reading.sheets[0].figures["velocity_plan"].nodes["b"]
    assert (x, y, who) == (round(node.x_mm, 3), round(node.y_mm, 3), "moved")


def test_a_polygon_in_another_order_stays_where_its_forces_lie():
    construction, figure = construction_for(load_assignment("pump-forces")), "force_plan_D"
    # The given forces lie elsewhere than in the usual order, in which the nodes are.
    drawn = {"F_D": [(200.0, 90.0), (260.0, 90.0)], "F_i4": [(260.0, 90.0), (260.0, 30.0)]}
    usual = {f"D.{corner}": [200.0 + 20.0 * corner, 90.0, "program"] for corner in range(4)}
    nodes = {name: ReadNode(complex(x, -y), np.eye(2), 1.0) for name, (x, y, _) in usual.items()}
    sheet = Sheet(np.eye(3), (420.0, 297.0), "markers", 12.0, 0.0, 0.1, 0.0, (5.0, 5.0, 410.0, 287.0))
    page = ScannedPage(
        PageRef("s.png"), sheet=sheet, ink=ink_of([]), reading=Reading({figure: Figure(nodes, {})})
    )
    keep = keep_of(page, construction, {"figures": {figure: usual}, "drawn": {figure: drawn}})
    assert {tuple(end) for ends in keep.strokes for end in ends} == {*chain.from_iterable(drawn.values())}
    assert {tuple(point) for points in keep.figures for point in points} == {
        *chain.from_iterable(drawn.values())
    }


@pytest.mark.slow
def test_what_is_given_can_be_read_and_measured(known, preview):
    file, _ = preview
    answer(file, ("yes", ""))
    collect(*known, file)
    points = list(points_of(file))
    read = [one for one in points if one.off_mm is not None and one.off_mm < 0.5]
    assert len(read) > 0.7 * len(points)
    assert {"moved", "audited", "disputed", "program"} <= {one.by for one in points}


def test_nothing_is_written_before_each_page_has_an_answer(known, preview):
    file, made = preview
    assert collect(*known, file).waiting == made.waiting
    answer(file, {"0001.png": ("yes", ""), "0002.png": ("", "")})
    assert collect(*known, file).waiting == ("0002.png",)
    assert not file.exists()
    answer(file, {"0001.png": ("da", ""), "0002.png": ("No", "")})
    assert collect(*known, file).given == 1
    answer(file, ("no", ""))
    with pytest.raises(CallError, match="no page is marked yes"):
        collect(*known, file)


def test_a_page_that_was_painted_on_must_be_looked_at_again(known, preview):
    file, made = preview
    path = made.preview / "0001.png"
    before = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    high, wide = before.shape
    answer(file, {"0001.png": ("yes", f"0 0 {wide} {high}"), "0002.png": ("yes", "")})
    assert collect(*known, file).waiting == ("0001.png",)
    after = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert np.ptp(after[100:140, 100:140]) < 5
    assert not np.array_equal(before, after)
    row = json.loads((made.preview / "truth.jsonl").read_text().splitlines()[0])
    assert not any(row["figures"].values())
    assert 'value="yes" checked' in (made.preview / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("0001.png,perhaps,\n0002.png,yes,", "line 2, give_away: 'perhaps'"),
        ("0001.png,yes,1 2 3\n0002.png,yes,", "line 2, cover: write x y"),
        ("0001.png,yes,\n0003.png,yes,", "line 3, page: '0003.png' is no page"),
        (
            "0001.png,yes,\n0001.png,no,",
            "line 3, page: '0001.png' is no page of this preview",
        ),
        ("0001.png,yes,", "'0002.png' is missing"),
    ],
)
def test_answers_that_cannot_be_understood_are_told(known, preview, text, why):
    file, made = preview
    (made.preview / "pages.csv").write_text(f"page,give_away,cover\n{text}\n", encoding="utf-8")
    with pytest.raises(TableError, match=re.escape(why)):
        collect(*known, file)
    assert not file.exists()


def test_a_preview_of_another_state_of_the_class_is_refused(known, preview):
    file, made = preview
    (made.preview / "state.txt").write_text("another")
    with pytest.raises(CallError, match="have changed since the pages were reviewed"):
        collect(*known, file)


def test_a_target_that_is_there_is_not_written_over(tmp_path):
    there = tmp_path / "there.zip"
    there.write_bytes(b"")
    (tmp_path / "other.preview").mkdir()
    for name, why in (
        ("there.zip", "already exists"),
        ("other.zip", "is no preview"),
        ("f.tar", "must end in .zip"),
    ):
        with pytest.raises(CallError, match=why):
            check_target(tmp_path / name)


def test_scans_that_are_gone_are_told(known, tmp_path):
    batch, run = known
    check_scans(batch, run.results.reports)
    moved = Batch(PUMP, RUBRIC, tmp_path, batch.out)
    with pytest.raises(CallError, match="are missing"):
        check_scans(moved, run.results.reports)
