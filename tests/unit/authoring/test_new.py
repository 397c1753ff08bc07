"""A new assignment: complete, commented, and usable as it is written."""

import re
import tomllib
from itertools import pairwise
from types import UnionType
from typing import get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from grader.authoring.lint import lint
from grader.authoring.new import new_assignment, starts, starts_folder
from grader.files import OutputError
from grader.rubric import RubricFile, WeightsTable, load_rubric, rubric_of
from reference.authored.assignment import AssignmentFile, built_in, library, load_assignment
from reference.authored.toml_file import Text
from reference.errors import CallError
from reference.plan import exact_plan

SAME_NUMBER = 1e-12


def tables_in(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A model and all those within it."""
    known: set[type[BaseModel]] = set()
    waiting: list[object] = [model]
    while waiting:
        kind = waiting.pop()
        if isinstance(kind, type) and get_origin(kind) is None and issubclass(kind, BaseModel):
            if kind not in known:
                known.add(kind)
                waiting.extend(field.annotation for field in kind.model_fields.values())
        elif get_args(kind) or isinstance(kind, UnionType):
            waiting.extend(get_args(kind))
    return known


FILES = [*library().glob("*.toml"), *starts_folder().glob("*.toml")]
TABLES = {*tables_in(AssignmentFile), *tables_in(RubricFile)} - {Text, WeightsTable}
"""Languages and the sections of a rubric explain themselves."""


@pytest.mark.parametrize("table", sorted(TABLES, key=lambda one: one.__name__), ids=lambda one: one.__name__)
def test_every_key_of_an_authored_file_is_shown_in_a_library_file(table):
    texts = "\n".join(path.read_text(encoding="utf-8") for path in FILES)
    for name, field in table.model_fields.items():
        key = field.alias or name
        shown = rf"(?m)(^|[{{\[,] ?|# ){key}( = |\])|^\[+(\w+\.)?{key}\]"
        assert re.search(shown, texts), key


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_each_key_of_a_library_file_is_explained_where_it_first_stands(path):
    """At the end of its line or on the line above; words of the three languages explain themselves."""
    lines = path.read_text(encoding="utf-8").splitlines()
    known, table = {("", "")}, ""
    for above, line in pairwise(["", *lines]):
        is_heading = line.startswith("[")
        table = line.strip("[]") if is_heading else table
        key = "" if is_heading else line.partition(" = ")[0].removeprefix("# ")
        is_key = is_heading or (re.fullmatch(r"[a-zA-Z]+(_\w+)?", key) and " = " in line)
        if (
            is_key
            and table not in {"title", "task", "ground", "variant.values"}
            and (table, key) not in known
        ):
            assert "  # " in line or above.startswith("#"), line
            known.add((table, key))


@pytest.mark.parametrize("start", starts())
def test_a_start_can_be_drawn_and_lint_finds_nothing_to_change(tmp_path, start):
    written = new_assignment(tmp_path / "mine", mechanism=start)
    assignment = load_assignment(written.assignment)
    rubric = rubric_of(assignment)
    plan = exact_plan(assignment, assignment.variants())
    vectors = {name for name, vector in plan.construction.vectors.items() if not vector.is_sum}
    assert {criterion.vector for criterion in rubric.criterion} - {None} == vectors
    found = lint(assignment, rubric)
    assert [one.told() for one in found.findings if one.severity != "hint"] == []
    assert found.scales[0].over_all.under_8_mm == 0


@pytest.mark.parametrize("name", built_in())
def test_an_assignment_like_another_has_the_same_plans_and_the_same_rubric(tmp_path, name):
    written = new_assignment(tmp_path / "own.assignment.toml", like=name)
    source, own = load_assignment(name), load_assignment(written.assignment)
    variants = source.variants()
    assert own.variants() == variants
    assert own.id == "own"
    renamed = {"id", "mechanism", "rubric"}
    assert own.file.model_dump(exclude=renamed) == source.file.model_dump(exclude=renamed)
    assert own.mechanism_file.model_dump(exclude={"id"}) == source.mechanism_file.model_dump(exclude={"id"})
    theirs, ours = exact_plan(source, variants), exact_plan(own, variants)
    for vector, values in theirs.vectors_si.items():
        np.testing.assert_allclose(ours.vectors_si[vector], values, rtol=SAME_NUMBER, atol=SAME_NUMBER)
    rubric = load_rubric(source.file.rubric, beside=source.path)
    assert rubric_of(own).model_copy(update={"id": rubric.id}) == rubric


def test_keys_that_are_not_set_are_shown_as_comments_that_would_be_valid(tmp_path):
    written = new_assignment(tmp_path / "mine")
    for path in (written.assignment, written.mechanism, written.rubric):
        offers = re.findall(
            r"^# (\w+ = .*?)(?:  # .*)?$", path.read_text(encoding="utf-8"), flags=re.MULTILINE
        )
        assert offers
        for offer in offers:
            tomllib.loads(offer)
    assert "# epsilon = " in written.mechanism.read_text(encoding="utf-8")
    assert "# position = " in written.assignment.read_text(encoding="utf-8")


def test_a_key_is_explained_once_in_a_file(tmp_path):
    written = new_assignment(tmp_path / "mine")
    text = written.rubric.read_text(encoding="utf-8")
    assert text.count("# for full marks") == 1
    assert text.count("points = ") > 10


@pytest.mark.parametrize("there", ["mine.assignment.toml", "mine.mechanism.toml", "mine.rubric.toml"])
def test_nothing_is_written_over_and_nothing_half(tmp_path, there):
    (tmp_path / there).write_text("mine", encoding="utf-8")
    with pytest.raises(CallError, match="already exists") as told:
        new_assignment(tmp_path / "mine")
    assert told.value.code == "file_exists"
    assert [path.name for path in tmp_path.iterdir()] == [there]
    assert (tmp_path / there).read_text(encoding="utf-8") == "mine"


def test_a_file_that_cannot_be_written_takes_the_others_with_it(tmp_path, monkeypatch):
    from pathlib import Path  # noqa: PLC0415

    opened = Path.open

    def full(self, mode="r", *args, **kwargs):
        if self.name == "mine.rubric.toml" and mode == "xb":
            raise OSError(28, "No space left on device", str(self))
        return opened(self, mode, *args, **kwargs)

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(OutputError, match="No space left"):
        new_assignment(tmp_path / "mine")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("file", "options", "code"),
    [
        ("mine", {"mechanism": "cam"}, "unknown_mechanism"),
        ("mine", {"like": "pmup"}, "unknown_assignment"),
        ("mine", {"like": "pump", "mechanism": "shaper"}, "like_or_mechanism"),
        ("my own", {}, "new_name"),
        (".toml", {}, "new_name"),
    ],
)
def test_a_wrong_call_writes_nothing(tmp_path, file, options, code):
    with pytest.raises(CallError) as told:
        new_assignment(tmp_path / file, **options)
    assert told.value.code == code
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("file", "names"),
    [
        ("a", ("a.assignment.toml", "a.mechanism.toml", "a.rubric.toml")),
        ("a.toml", ("a.toml", "a.mechanism.toml", "a.rubric.toml")),
        ("a.assignment.toml", ("a.assignment.toml", "a.mechanism.toml", "a.rubric.toml")),
        ("new/folder/a.b", ("a.b.assignment.toml", "a.b.mechanism.toml", "a.b.rubric.toml")),
    ],
)
def test_the_files_are_named_after_the_call(tmp_path, file, names):
    written = new_assignment(tmp_path / file)
    assert tuple(path.name for path in (written.assignment, written.mechanism, written.rubric)) == names
    assert rubric_of(load_assignment(written.assignment)).max_score > 0


def test_the_last_groups_joint_gives_the_most_points(tmp_path):
    for start, result in (("shaper", "D"), ("tangent", "B"), ("slider-crank", "B")):
        rubric = rubric_of(load_assignment(new_assignment(tmp_path / start, mechanism=start).assignment))
        points = {criterion.name: criterion.points for criterion in rubric.criterion}
        most = {name for name, worth in points.items() if worth == max(points.values())}
        assert most == {f"v_{result}", f"a_{result}"}


INLINE = """
schema_version = 1
id = 'own'  # mine
rubric = "pump"
[title]
en = "T"
[task]
en = "T"
# all of it here
[mechanism]
schema_version = 1
id = "slider"
length_unit = "cm"
[mechanism.title]
en = "M"
[mechanism.ground]
O1 = [0, 0]
[mechanism.crank]
link = "1"
pivot = "O1"
pin = "A"
length = 20
angle_deg = "10*n"
omega = 1
[[mechanism.group]]
type = "RRP"
node = "B"
pin = "A"
link = "2"
length = 50
guide = { through = [0, 0], angle_deg = 0 }
side = "ahead"
[variant]
n = { from = 1, to = 3 }
[scales]
crank_mm = 50
kL = "crank_m / crank_mm"
kv = "omega * kL"
ka = "omega**2 * kL"
[[page]]
kind = "all"
figures = ["mechanism", "velocity_plan"]
"""


def test_a_mechanism_within_an_assignment_gets_a_file_of_its_own(tmp_path):
    (tmp_path / "old.assignment.toml").write_text(INLINE, encoding="utf-8")
    written = new_assignment(tmp_path / "mine", like=str(tmp_path / "old.assignment.toml"))
    source, own = load_assignment(tmp_path / "old.assignment.toml"), load_assignment(written.assignment)
    assert own.file.mechanism == "mine"
    assert own.mechanism_file.model_dump(exclude={"id"}) == source.mechanism_file.model_dump(exclude={"id"})
    renamed = {"id", "mechanism", "rubric"}
    assert own.file.model_dump(exclude=renamed) == source.file.model_dump(exclude=renamed)
    assert 'id = "mine"  # mine' in written.assignment.read_text(encoding="utf-8")


def test_a_copy_of_a_copy_has_the_comments_and_one_head(tmp_path):
    first = new_assignment(tmp_path / "first", like="pump")
    second = new_assignment(tmp_path / "second", like=str(first.assignment))
    for kind in ("assignment", "mechanism", "rubric"):
        text = getattr(first, kind).read_text(encoding="utf-8").replace("like pump", "like first")
        expected = re.sub(r"\bfirst([.\"])(?=mech|rub|assi|  #)", r"second\1", text)
        assert getattr(second, kind).read_text(encoding="utf-8") == expected


def test_a_file_whose_names_cannot_be_replaced_is_refused(tmp_path):
    text = INLINE.replace("id = 'own'", '"id" = "own"', 1)
    (tmp_path / "old.assignment.toml").write_text(text, encoding="utf-8")
    with pytest.raises(CallError, match="each on a line of its own"):
        new_assignment(tmp_path / "mine", like=str(tmp_path / "old.assignment.toml"))
    assert [path.name for path in tmp_path.iterdir()] == ["old.assignment.toml"]


def test_a_rubric_that_asks_for_no_force_gets_what_the_force_plans_show(tmp_path):
    first = new_assignment(tmp_path / "first", like="pump-forces")
    text = first.rubric.read_text(encoding="utf-8")
    head, *criteria = text.split("[[criterion]]")
    of_motion = [one for one in criteria if 'scale = "kL"' in one]
    # Its first keys stand right before a criterion.
    own = "[[criterion]]".join([head.replace("\n\n", "\n"), *of_motion])
    first.rubric.write_text(own, encoding="utf-8")
    second = new_assignment(tmp_path / "second", like=str(first.assignment))
    asked = {one.name: one for one in load_rubric(second.rubric).criterion}
    built_in = {one.name for one in load_rubric("pump-forces").criterion}
    assert built_in <= asked.keys()
    assert {"R_13_n", "v_A", "omega_3", "kv", "AS3", "BS3"}.isdisjoint(asked)
    assert asked["R_13_t"].title.in_language("ro").endswith("reacțiunii elementului 1 asupra elementului 3")
    assert asked["R_0D"].title.en == "Reaction of the frame on link D"
    assert not [one for one in asked.values() if one.title.ru == one.title.en]
    findings = lint(load_assignment(second.assignment), load_rubric(second.rubric)).findings
    assert not [one for one in findings if one.severity == "fault"]
