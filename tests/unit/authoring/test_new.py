"""A new assignment: complete, commented, and usable as it is written."""

import re
import tomllib
from types import UnionType
from typing import get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from grader.authoring.comments import KEYS, TABLES, commented, inline, quoted
from grader.authoring.lint import lint
from grader.authoring.new import joints_of, new_assignment, rubric_for, starts
from grader.files import OutputError
from grader.rubric import CriterionTable, RubricFile, load_rubric, rubric_of
from reference.assignment import built_in, load_assignment
from reference.assignment_file import AssignmentFile
from reference.authored import Text
from reference.errors import CallError
from reference.plan import exact_plan

SAME_NUMBER = 1e-12


def models_in(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A model and all those within it."""
    seen: set[type[BaseModel]] = set()
    waiting: list[object] = [model]
    while waiting:
        kind = waiting.pop()
        if isinstance(kind, type) and get_origin(kind) is None and issubclass(kind, BaseModel):
            if kind not in seen:
                seen.add(kind)
                waiting.extend(field.annotation for field in kind.model_fields.values())
        elif get_args(kind) or isinstance(kind, UnionType):
            waiting.extend(get_args(kind))
    return seen


ALL_MODELS = {*models_in(AssignmentFile), *models_in(RubricFile)}


@pytest.mark.parametrize(
    "model", sorted(ALL_MODELS, key=lambda one: one.__name__), ids=lambda one: one.__name__
)
def test_every_key_of_an_authored_file_is_explained(model):
    assert set(model.model_fields) == set(KEYS[model.__name__])


def test_nothing_is_explained_that_is_not_there():
    assert {model.__name__ for model in ALL_MODELS} == set(KEYS)
    assert set(TABLES) <= set(KEYS)


@pytest.mark.parametrize("start", starts())
def test_a_start_can_be_drawn_and_lint_finds_nothing_to_change(tmp_path, start):
    written = new_assignment(tmp_path / "mine", mechanism=start)
    assignment = load_assignment(written.assignment)
    rubric = rubric_of(assignment)
    plan = exact_plan(assignment, assignment.variants())
    assert {criterion.vector for criterion in rubric.criterion} - {None} == set(plan.vectors_si)
    found = lint(assignment, rubric)
    assert [str(one) for one in found.findings if one.severity != "hint"] == []
    assert found.scales[0].under_8_mm == 0


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
    with pytest.raises(CallError, match="is there already") as told:
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


def test_the_plates_two_ways_are_optional_in_a_rubric_made_from_the_construction():
    pump = load_assignment("pump")
    made = rubric_for("x", Text(en="X"), pump.mechanism(pump.variants()[:1]))
    optional = {criterion.vector for criterion in made.criterion if criterion.optional} - {None}
    assert optional == {"v_CA", "v_CB", "a_CA_n", "a_CA_t", "a_CB_n", "a_CB_t"}
    points = {criterion.name: criterion.points for criterion in made.criterion}
    assert points["v_D"] == points["a_D"] > points["v_B"] > points["a_B_t"] > points["omega_3"]


def test_the_last_groups_joint_gives_the_most_points(tmp_path):
    for start, result in (("shaper", "D"), ("tangent", "B"), ("slider-crank", "B")):
        rubric = rubric_of(load_assignment(new_assignment(tmp_path / start, mechanism=start).assignment))
        points = {criterion.name: criterion.points for criterion in rubric.criterion}
        most = {name for name, worth in points.items() if worth == max(points.values())}
        assert most == {f"v_{result}", f"a_{result}"}


@pytest.mark.parametrize(
    ("about", "joints"),
    [("BA", ("B", "A")), ("B", ("B", "")), ("B3B", ("B3", "B")), ("A3", ("A3", "")), ("D5D", ("D5", "D"))],
)
def test_the_joints_of_a_vectors_name(about, joints):
    assert joints_of(about, ("O1", "A", "A3", "B", "B3", "D", "D5")) == joints


@pytest.mark.parametrize(
    "text", ["plain", 'with "quotes"', "back\\slash", "line\nbreak", "tab\t", "Ελλ", "\x7f\x01"]
)
def test_any_text_survives_being_written(text):
    assert tomllib.loads(f"key = {quoted(text)}")["key"] == text
    assert tomllib.loads(f"key = {inline([text, True, 2, 0.5])}")["key"] == [text, True, 2, 0.5]


def test_a_comment_is_never_wider_than_a_page():
    title = Text(en="word " * 60)
    criterion = CriterionTable(id="v_A", title=title, points=1.0, vector="v_A")
    rubric = RubricFile(schema_version=1, id="x", title=title, criterion=[criterion])
    text = commented(rubric, "head " * 60)
    assert max(len(line) for line in text.splitlines() if line.startswith("# ")) <= 100
    assert RubricFile.model_validate(tomllib.loads(text)) == rubric
