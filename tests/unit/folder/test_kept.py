import json
import shutil
import zlib
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import grader
import grader.scan.page as page_module
from grader import pipeline
from grader.feedback.class_page import change_lines
from grader.files import samples_folder
from grader.folder import batch as batch_module
from grader.folder import batch as jobs_module
from grader.folder import cache as kept_module
from grader.folder.batch import Batch, InterruptedRunError, grade
from grader.folder.cache import (
    MARK_STAGE,
    READ_STAGE,
    SCAN_STAGE,
    PageCache,
    cached_maps,
    cached_reading,
    digest_of,
    dumped,
    loaded,
    stage_digest,
    store_reading,
)
from grader.folder.inventory import identify_page, take_inventory
from grader.language import tongue
from grader.overlay.backdrop import backdrop
from grader.records import (
    Figure,
    Page,
    PageRef,
    Reading,
    ReadNode,
    ReadVector,
    Reason,
    ScannedPage,
    Sheet,
    Swapped,
    Unread,
)
from grader.rubric import load_rubric
from grader.similarity.groups import CELLS
from grader.solution.document import plan_document
from reference.authored.assignment import Variant, load_assignment
from reference.plan import exact_plan
from tests.inline import Inline

PUMP = load_assignment("pump")
RUBRIC = load_rubric("pump-velocity")
SCALES = "1:5,kv = omega kL"


def drawn_exactly(n, off_mm=0.0):
    """The reading of an exact velocity plan, with v_D longer by `off_mm`."""
    plan = plan_document(PUMP, exact_plan(PUMP, [Variant(n=n)]))
    vectors = {
        name: ReadVector(
            one.drawn_mm + (off_mm if name == "v_D" else 0.0), 0.05, one.direction_deg, 0.05, 0.99
        )
        for name, one in plan.vectors.items()
        if name.startswith("v")
    }
    nodes = {"o": ReadNode(100.0 - 80.0j, 0.01 * np.eye(2), 0.99)}
    return Reading(
        {"velocity_plan": Figure(nodes, vectors)},
        (Unread("v_CB", Reason("upstream_unsure", {"nodes": ("n_CA", "c")})),),
    )


class Reader:
    """Stands for the naming of what scans show, and knows whose it has named."""

    def __init__(self, off_mm=4.0):
        self.read, self.off_mm = [], off_mm

    def __call__(self, submission, pages, _assignment, _asked):
        self.read.append(submission.student_id)
        reading = drawn_exactly(submission.variant.n, off_mm=self.off_mm)
        return [
            replace(
                page,
                reading=reading,
                problems=(Reason("told", {"detail": "something"}, page.ref.file),),
                timing_ms={},
            )
            for page in pages
        ]


@pytest.fixture
def reader(monkeypatch):
    found = Reader()
    monkeypatch.setattr(batch_module, "read_submission", found)
    return found


def scan(path, x):
    grey = np.full((200, 300), 245, np.uint8)
    cv2.line(grey, (x, 20), (x + 90, 170), 40, 3)
    cv2.imwrite(str(path), grey)


@pytest.fixture
def class_folder(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    for x, student in enumerate(("s1", "s2"), start=1):
        scan(folder / f"{student}.png", 40 * x)
    roster(folder, s1=4, s2=9)
    return folder


def roster(folder, **numbers):
    lines = [f"{student},{student.upper()},{n},{SCALES}" for student, n in numbers.items()]
    (folder / "roster.csv").write_text("\n".join(["student_id,name,n,kL,kv", *lines]) + "\n")


def run(folder, out, rubric=RUBRIC, progress=lambda *_: None):
    return grade(Batch(PUMP, rubric, folder, out), progress, Inline())


def wider(rubric):
    """The rubric with wider tolerances."""
    table = rubric.tolerance.model_copy(update={"length_mm": 6.0, "across_mm": 6.0})
    return rubric.model_copy(update={"tolerance": table})


@pytest.mark.usefixtures("reader")
def test_what_moved_is_told_with_the_standing_before_and_after(class_folder, tmp_path):
    out = tmp_path / "out"
    assert run(class_folder, out).moved == []
    again = run(class_folder, out, wider(RUBRIC))
    assert {one.student_id for one in again.moved} == {"s1", "s2"}
    told = list(change_lines(again, tongue("en")))
    assert sorted(told) == [
        "s1: 16.66 → 20.5 (the rubric was changed)",
        "s2: 16.66–18.58 → 20.5 (the rubric was changed)",
    ]
    assert json.loads((out / "results.json").read_text())["moved"][0]["after"]["status"] == "graded"
    assert run(class_folder, out, wider(RUBRIC)).moved == []
    scan(class_folder / "s3.png", 130)
    roster(class_folder, s1=4, s3=5)
    (class_folder / "s2.png").unlink()
    changed = {one.student_id: one for one in run(class_folder, out, wider(RUBRIC)).moved}
    assert changed.keys() == {"s2", "s3"}
    assert changed["s2"].after is None
    assert changed["s3"].before is None


def test_a_changed_line_of_the_roster_reads_only_that_students_scan_again(class_folder, tmp_path, reader):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    roster(class_folder, s1=4, s2=10)
    assert [one.student_id for one in run(class_folder, tmp_path / "out").moved] in ([], ["s2"])
    assert reader.read == ["s2"]


def test_an_added_file_is_read_and_no_other(class_folder, tmp_path, reader):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    scan(class_folder / "s3.png", 130)
    roster(class_folder, s1=4, s2=9, s3=5)
    run(class_folder, tmp_path / "out")
    assert reader.read == ["s3"]


def test_a_file_with_other_content_is_read_again_and_one_only_touched_is_not(class_folder, tmp_path, reader):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    (class_folder / "s1.png").touch()
    scan(class_folder / "s2.png", 150)
    run(class_folder, tmp_path / "out")
    assert reader.read == ["s2"]


@pytest.mark.usefixtures("reader")
def test_each_page_is_decoded_registered_and_tested_for_blankness_once(class_folder, tmp_path, monkeypatch):
    calls = []
    for name in ("decode", "is_blank", "register"):
        function = getattr(page_module, name)
        monkeypatch.setattr(
            page_module,
            name,
            lambda *given, name=name, function=function: calls.append(name) or function(*given),
        )
    run(class_folder, tmp_path / "out")
    assert calls == ["decode", "is_blank", "register"] * 2
    calls.clear()
    scan(class_folder / "s2.png", 150)
    run(class_folder, tmp_path / "out", wider(RUBRIC))
    assert calls == ["decode", "is_blank", "register"]
    assert len(list((tmp_path / "out" / ".planmark" / "pages").glob("*.page"))) == 2


class SlowStrokes(Inline):
    """Workers that take too long to find strokes."""

    def run(self, function, calls, sheets=()):
        if function is identify_page:
            yield from enumerate([Reason("too_slow", {"detail": "took more than 60 s"})] * len(calls))
        else:
            yield from super().run(function, calls, sheets)


def test_a_page_whose_strokes_take_too_long_still_has_the_owner_that_its_code_says(tmp_path):
    path = samples_folder() / "pump" / "s06_1.jpg"
    contents = take_inventory(
        [path], path.parent, None, SlowStrokes(), lambda *_: None, PageCache(tmp_path / "pages")
    )
    (page,) = contents[0].pages
    assert page.problem == Reason("too_slow", {"detail": "took more than 60 s"}, "s06_1.jpg")
    assert page.identity is not None
    assert page.identity.student_id == "s06"


@pytest.mark.usefixtures("reader")
def test_a_page_under_another_name_is_not_told_under_the_old_one(class_folder, tmp_path):
    run(class_folder, tmp_path / "out")
    (class_folder / "s1.png").rename(class_folder / "s1_again.png")
    (first, _) = run(class_folder, tmp_path / "out").reports
    assert [sheet.source for sheet in first.reading.sheets] == ["s1_again.png"]


def test_an_interrupted_run_goes_on_where_it_was(class_folder, tmp_path, reader):
    def interrupt(what, done, _total):
        if what == "marking" and done == 1:
            raise KeyboardInterrupt

    with pytest.raises(InterruptedRunError, match="1 of 2 submissions are marked"):
        run(class_folder, tmp_path / "out", progress=interrupt)
    assert reader.read == ["s1"]
    results = run(class_folder, tmp_path / "out")
    assert reader.read == ["s1", "s2"]
    assert results.reports == run(class_folder, tmp_path / "other").reports


@pytest.mark.parametrize(
    "damage",
    [b"", b"{", b"[]", zlib.compress(b"[]"), dumped([1, 2]), dumped(["", "", [3]]), dumped({})],
)
def test_notes_that_are_damaged_are_not_relied_on(class_folder, tmp_path, reader, damage):
    first = run(class_folder, tmp_path / "out")
    for note in (tmp_path / "out" / ".planmark").rglob("*.*"):
        if note.suffix in {".json", ".page", ".reading"}:
            note.write_bytes(damage)
    (tmp_path / "out" / "s1" / "feedback.html").unlink()
    reader.read.clear()
    assert run(class_folder, tmp_path / "out").reports == first.reports
    assert reader.read == ["s1"]


def test_records_come_back_as_they_were():
    reading = drawn_exactly(4)
    back = loaded(dumped(reading))
    assert back.unread == reading.unread
    assert back.figures["velocity_plan"].vectors == reading.figures["velocity_plan"].vectors
    node, kept = reading.figures["velocity_plan"].nodes["o"], back.figures["velocity_plan"].nodes["o"]
    assert (kept.at, kept.confidence) == (node.at, node.confidence)
    assert np.array_equal(kept.cov, node.cov)


def test_a_scanned_page_comes_back_with_its_ink_to_the_last_digit(tmp_path):
    sample = samples_folder() / "pump" / "s01_1.jpg"
    ref = PageRef(sample.name, path=sample)
    cache = PageCache(tmp_path)
    now, then = cache.page(ref), cache.page(ref)
    assert now.ink is not None
    assert then is not now
    assert dumped(then) == dumped(now)
    assert then.ink.strokes.ends.dtype == now.ink.strokes.ends.dtype
    identified = cache.identified(ref)
    assert identified.content
    assert replace(identified, content="") == now.ref


def test_a_page_turned_by_its_drawing_has_a_scan_of_its_own(tmp_path):
    cache, ref = PageCache(tmp_path), PageRef("s1.png")
    assert cache.path_of(ref) != cache.path_of(replace(ref, tilt_rad=(0.02, 0.003)))


def test_cells_that_moved_are_read_again_on_printed_sheets_alone(tmp_path):
    plain = ScannedPage(PageRef("s1.png"))
    sheet = Sheet(np.eye(3), (420.0, 297.0), "markers", 8.0, 0.0, 0.1, 0.002, (0.0, 0.0, 1.0, 1.0))
    printed = replace(plain, sheet=replace(sheet, zones={"mechanism": (0.0, 0.0, 1.0, 1.0)}))
    before, after = PageCache(tmp_path, printed_key="before"), PageCache(tmp_path, printed_key="after")
    for page in (plain, printed):
        store_reading(
            tmp_path,
            "s1",
            "key",
            [replace(page, ref=PageRef("s1", problem=Reason("a", {"detail": "b"})))],
            before,
        )
        assert (cached_reading(tmp_path, "s1", "key", after) is None) == (page is printed)


def test_a_reading_is_not_found_under_another_key_nor_half_written(tmp_path, monkeypatch):
    pages = [
        ScannedPage(
            PageRef("s1.png", problem=Reason("told", {"detail": "something"})), reading=drawn_exactly(4)
        )
    ]
    cache = PageCache(tmp_path)
    store_reading(tmp_path, "s1", "one", pages, cache)
    assert cached_reading(tmp_path, "s1", "one", cache) is not None
    assert cached_reading(tmp_path, "s1", "two", cache) is None

    def full_disk(*_):
        raise OSError("no room")

    monkeypatch.setattr(kept_module, "write_whole", full_disk)
    with pytest.raises(OSError, match="no room"):
        store_reading(tmp_path, "s1", "two", pages, cache)
    assert cached_reading(tmp_path, "s1", "two", cache) is None


# What a stage depends on --------------------------------------------------------------------------

STAGES = {"scan": SCAN_STAGE, "read": READ_STAGE, "mark": MARK_STAGE}
TOP = Path(grader.__file__).parent.parent


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """A copy of the program that may be changed."""
    top = tmp_path_factory.mktemp("sources")
    for package in ("grader", "reference"):
        shutil.copytree(TOP / package, top / package, ignore=shutil.ignore_patterns("__pycache__", "samples"))
    (top / "tests").mkdir()
    (top / "tests" / "bench.py").write_text("")
    return top, digests(top)


def digests(top):
    """The digest of each stage of the work, by the sources in a folder."""
    stage_digest.cache_clear()
    return {stage: stage_digest(modules, top=top) for stage, modules in STAGES.items()}


@pytest.mark.parametrize(
    ("file", "stale"),
    [
        ("grader/scan/strokes/nodes.onnx", {"scan", "read", "mark"}),
        ("grader/scan/handwriting/letters.npz", {"scan", "read", "mark"}),
        ("grader/scan/decode/pictures.py", {"scan", "mark"}),
        ("grader/records.py", {"scan", "read", "mark"}),
        ("grader/pipeline.py", {"scan", "read", "mark"}),
        ("grader/scan/page.py", {"scan", "read", "mark"}),
        ("grader/reading/plans.py", {"read", "mark"}),
        ("grader/marking/mark.py", {"mark"}),
        ("grader/feedback/templates/feedback.html", {"mark"}),
        ("grader/locale/ro/LC_MESSAGES/planmark.mo", {"mark"}),
        ("grader/printed/layout.py", {"scan", "read", "mark"}),
        ("grader/printed/answer_sheet.py", set()),
        ("grader/printed/pdf.py", set()),
        ("reference/drawing/labels.py", {"mark"}),
        ("grader/cli/grading.py", set()),
        ("tests/bench.py", set()),
    ],
)
def test_what_a_change_makes_stale(sources, file, stale):
    top, before = sources
    path = top / file
    content = path.read_bytes()
    path.write_bytes(content + b"\n# changed\n")
    after = digests(top)
    path.write_bytes(content)
    assert {stage for stage in before if after[stage] != before[stage]} == stale


def test_every_module_that_the_order_of_work_calls_is_in_a_stage():
    """The scan and the reading are all that `grader.pipeline` and `grader.scan.page` do before marking."""
    assert stage_digest(MARK_STAGE) != stage_digest(READ_STAGE)
    modules = kept_module._closure([*SCAN_STAGE, *READ_STAGE], TOP)
    for name in SCANS_AND_READS:
        assert {**vars(page_module), **vars(pipeline)}[name].__module__ in modules


SCANS_AND_READS = (
    "backdrop", "declared_scales", "decode", "find_ink", "find_letters", "is_blank",
    "read_figures", "register", "straighten", "sure_texts", "written_numbers", "written_scales",
)  # fmt: skip


def test_another_version_of_the_program_reads_again(class_folder, tmp_path, reader, monkeypatch):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    monkeypatch.setattr(batch_module, "READ_STAGE", (*READ_STAGE, "grader.cli"))
    run(class_folder, tmp_path / "out")
    assert sorted(reader.read) == ["s1", "s2"]


# Regrading ----------------------------------------------------------------------------------------


def rubric_with(**changes):
    """The rubric with some of its fields changed."""
    return type(RUBRIC).model_validate({**RUBRIC.model_dump(exclude_unset=True), **changes})


def criteria_with(**changes):
    first, *others = RUBRIC.model_dump(exclude_unset=True)["criterion"]
    return [{**first, **changes}, *others]


CHANGES = {
    "tolerance": {"length_mm": 5.0, "across_mm": 5.0, "bands": [{"factor": 1.5, "share": 0.4}]},
    "hand": {"angle_deg": 0.6, "sigmas": 3.0},
    "weights": {"velocity_plan": 30.0},
    "missing": "not_judged",
    "doubt": {"settle": 0.9, "in_doubt": "strict", "stake": 0.2},
    "least_confidence": 0.5,
    "follow_through": False,
    "least_followed_share": 0.4,
    "values_alone": True,
    "accelerations": "given",
    "criterion": criteria_with(points=7.0, follow_through=False, tolerance={"length_mm": 0.5}),
}


def test_every_field_of_a_rubric_is_among_the_changes():
    assert CHANGES.keys() == type(RUBRIC).model_fields.keys() - {"schema_version", "id", "title"}


def test_no_change_of_a_rubric_reads_a_scan_again_and_each_gives_what_a_fresh_run_gives(
    class_folder, tmp_path, reader
):
    run(class_folder, tmp_path / "out")
    for name, change in CHANGES.items():
        reader.read.clear()
        again = run(class_folder, tmp_path / "out", rubric_with(**{name: change}))
        assert reader.read == [], name
        fresh = run(class_folder, tmp_path / f"fresh {name}", rubric_with(**{name: change}))
        assert again.reports == fresh.reports


@pytest.mark.usefixtures("reader")
def test_what_moved_names_the_criteria_and_the_rubric_as_the_why(class_folder, tmp_path):
    out = tmp_path / "out"
    first = run(class_folder, out)
    again = run(class_folder, out, wider(RUBRIC))
    for one in again.moved:
        assert one.why == ["rubric"]
        then = {c.id: c for c in next(r for r in first.reports if r.student_id == one.student_id).criteria}
        now = {c.id: c for c in next(r for r in again.reports if r.student_id == one.student_id).criteria}
        changed = {
            name
            for name in now
            if (now[name].verdict, now[name].points) != (then[name].verdict, then[name].points)
        }
        assert {criterion.id for criterion in one.criteria} == changed != set()
        for criterion in one.criteria:
            assert (criterion.before, criterion.after) == (
                then[criterion.id].verdict,
                now[criterion.id].verdict,
            )
    told = json.loads((out / "results.json").read_text())["moved"][0]["criteria"][0]
    assert {"id", "title", "before", "after", "points_before", "points_after"} == told.keys()


@pytest.mark.usefixtures("reader")
def test_a_criterion_that_is_new_or_dropped_is_told_against_nothing(class_folder, tmp_path):
    run(class_folder, tmp_path / "out")
    dropped = rubric_with(criterion=RUBRIC.model_dump(exclude_unset=True)["criterion"][1:])
    name = RUBRIC.criterion[0].id
    fewer = run(class_folder, tmp_path / "out", dropped)
    assert all(any((c.id, c.after) == (name, None) for c in one.criteria) for one in fewer.moved)
    more = run(class_folder, tmp_path / "out")
    assert all(any((c.id, c.before) == (name, None) for c in one.criteria) for one in more.moved)


@pytest.mark.usefixtures("reader")
def test_a_new_scan_and_a_new_number_are_told_as_the_why(class_folder, tmp_path, monkeypatch):
    out = tmp_path / "out"
    run(class_folder, out)
    monkeypatch.setattr(batch_module, "read_submission", Reader(off_mm=0.0))
    scan(class_folder / "s2.png", 150)
    assert [(one.student_id, one.why) for one in run(class_folder, out).moved] == [("s2", ["submission"])]
    roster(class_folder, s1=5, s2=9)
    monkeypatch.setattr(batch_module, "read_submission", Reader(off_mm=0.0))
    assert [(one.student_id, one.why) for one in run(class_folder, out).moved] == [("s1", ["roster"])]
    for module in (batch_module, jobs_module):
        monkeypatch.setattr(module, "MARK_STAGE", (*MARK_STAGE, "grader.cli"))
    monkeypatch.setattr(batch_module, "READ_STAGE", (*READ_STAGE, "grader.cli"))
    monkeypatch.setattr(batch_module, "read_submission", Reader(off_mm=4.0))
    assert {cause for one in run(class_folder, out).moved for cause in one.why} == {"program"}


@pytest.mark.usefixtures("reader")
@pytest.mark.parametrize("damage", [b"", b"[]", b'{"common": 1, "own": 2}', b'{"own": {}}'])
def test_a_damaged_note_of_inputs_leaves_the_why_open(class_folder, tmp_path, damage):
    run(class_folder, tmp_path / "out")
    (tmp_path / "out" / ".planmark" / "inputs.json").write_bytes(damage)
    again = run(class_folder, tmp_path / "out", wider(RUBRIC))
    assert again.moved
    assert all(one.why == [] for one in again.moved)


@pytest.mark.usefixtures("reader")
def test_sheets_scanned_twice_are_told_beside_the_marks(class_folder, tmp_path):
    """The pairs whose ink is similar are kept with the readings: a regrade finds the same."""
    numbers = {}
    for k in range(8):
        scan(class_folder / f"t{k}.png", 20 * k + 11)
        numbers[f"t{k}"] = 3 + k
    roster(class_folder, s1=4, s2=9, **numbers)
    first = run(class_folder, tmp_path / "out")
    again = run(class_folder, tmp_path / "out", wider(RUBRIC))
    assert again.alike == first.alike


def test_swapped_letters_are_kept_with_a_reading():
    reading = Reading({}, swapped=(Swapped("velocity_plan", "b", "c", 0.97),))
    assert loaded(dumped(reading)).swapped == reading.swapped


def test_ink_maps_come_back_and_damaged_ones_are_none(tmp_path):
    page = Page("s1.png", 1, np.full((600, 800), 120, np.uint8))
    behind = replace(backdrop(page, None), registered=True, page_mm=(420.0, 297.0))
    store_reading(
        tmp_path, "s1", "key", [ScannedPage(PageRef("s1.png"), backdrop=behind)], PageCache(tmp_path)
    )
    (found,) = cached_maps(tmp_path, "s1")
    assert found.shape == CELLS
    (tmp_path / "s1.ink").write_bytes(b"no map")
    assert cached_maps(tmp_path, "s1") == []
    assert cached_maps(tmp_path, "nobody") == []


def test_the_order_of_a_set_which_differs_between_processes_is_no_change():
    class Backwards(frozenset):
        def __iter__(self):
            return reversed(list(super().__iter__()))

    figures = {"mechanism", "velocity_plan", "acceleration_plan"}
    assert digest_of([Backwards(figures)]) == digest_of([frozenset(figures)])
    assert digest_of([frozenset(figures)]) != digest_of([frozenset({"mechanism"})])
