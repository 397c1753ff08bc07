"""Rubric files: what is understood, and every fault told with its path."""

import pytest

from grader.rubric import ToleranceTable, check_rubric, load_rubric, rubric_of
from grader.texts.spoken import ENGLISH, clause, in_english
from reference.authored.assignment import built_in, library, load_assignment
from reference.construction.derive import construction_of
from reference.errors import AuthoredFileError, CallError
from reference.plan import construction_for
from tests.told import tells

HEAD = 'schema_version = 1\nid = "r"\ntitle = { en = "r" }\n'


def criterion(text, name="v_A"):
    return f'[[criterion]]\nid = "{name}"\ntitle = {{ en = "x" }}\npoints = 1.0\n{text}\n'


@pytest.fixture
def rubric(tmp_path):
    """Writes a rubric and loads it."""

    def load(text):
        path = tmp_path / "r.rubric.toml"
        path.write_text(HEAD + text, encoding="utf-8")
        return load_rubric(str(path))

    return load


def test_a_small_rubric_has_the_tolerances_of_marking_practice(rubric):
    found = rubric(criterion('vector = "v_A"') + criterion('scale = "kv"', "kv"))
    tolerance = found.tolerance
    assert (tolerance.length_mm, tolerance.length_relative) == (1.0, 0.02)
    assert (tolerance.direction_deg, tolerance.across_mm, tolerance.partial_factor) == (1.5, 0.5, 2.0)
    assert found.max_score == 2.0
    assert found.vectors == ("v_A",)
    assert [one.name for one in found.criterion] == ["v_A", "kv"]
    assert not found.needs_accelerations


@pytest.mark.parametrize("text", ['vector = "a_A"', 'angular = "epsilon_3"', 'scale = "ka"'])
def test_what_needs_accelerations_is_known(rubric, text):
    assert rubric(criterion(text)).needs_accelerations


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        (criterion(""), r"$.criterion[0]", "exactly one of"),
        (criterion('vector = "v_A"\nangular = "omega_2"'), r"$.criterion[0]", "exactly one of"),
        (criterion('vector = "v_A"\npoins = 3'), r"$.criterion[0].poins", "did you mean points?"),
        (criterion('point = "J3"\nfigure = "mechanism"'), r"$.criterion[0]", "only a vector may have"),
        (criterion('point = "J3"\ndirection = false'), r"$.criterion[0]", "must have a direction"),
        (criterion('scale = "kq"'), r"$.criterion[0].scale", "kL"),
        (criterion('vector = "v_A"').replace("1.0", "-1.0"), r"$.criterion[0].points", "must be > 0"),
        (criterion('vector = "v_A"') * 2, r"$.criterion[1].id", "there more than once"),
        (
            "[tolerance]\npartial_factor = 0.5\n" + criterion('vector = "v_A"'),
            r"$.tolerance.partial_factor",
            "1",
        ),
        ("criterion = []\n", r"$.criterion", "at least 1"),
        (criterion('vector = "v_A"\nlink = "AB"'), r"$.criterion[0]", "exactly one of"),
        ("[weights]\nangular = 5\n" + criterion('vector = "v_A"'), r"$.weights.angular", "no criterion"),
        ("[weights]\nsketch = 5\n" + criterion('vector = "v_A"'), r"$.weights.sketch", "known"),
        ("[weights]\nscales = 0\n" + criterion('scale = "kv"'), r"$.weights.scales", "must be > 0"),
        ("[hand]\nat_most = 0.5\n" + criterion('vector = "v_A"'), r"$.hand.at_most", "1"),
        (
            "[tolerance]\nbands = [{ factor = 2, share = 0.5 }, { factor = 1.5, share = 0.2 }]\n"
            + criterion('vector = "v_A"'),
            r"$.tolerance",
            "rising factors and falling shares",
        ),
        (
            "[tolerance]\npartial_share = 0.5\nbands = []\n" + criterion('vector = "v_A"'),
            r"$.tolerance",
            "one or the other",
        ),
    ],
)
def test_a_fault_is_told_with_its_path(rubric, text, where, what):
    with pytest.raises(AuthoredFileError) as caught:
        rubric(text)
    assert where in in_english(caught.value)
    assert what in in_english(caught.value)


def test_names_that_the_mechanism_does_not_have_are_faults(rubric):
    found = rubric(
        criterion('vector = "v_X"') + criterion('angular = "omega_9"', "w") + criterion('link = "AD"', "l")
    )
    assignment = load_assignment("pump")
    construction = construction_of(assignment.mechanism(assignment.variants()[:1]))
    faults = [finding.path for finding in check_rubric(found, construction)]
    assert faults == ["$.criterion[0].vector", "$.criterion[1].angular", "$.criterion[2].link"]


def test_what_a_section_is_worth_is_divided_into_cents_that_add_up(rubric):
    named = "".join(criterion(f'vector = "v_{name}"', f"v_{name}") for name in "ABC")
    points = rubric("[weights]\nvelocity_plan = 10\n" + named).points
    assert sorted(points.values()) == [3.33, 3.33, 3.34]


def test_weights_scale_the_points_of_a_section_and_leave_the_others(rubric):
    found = rubric(
        "[weights]\nvelocity_plan = 10\n"
        + criterion('vector = "v_A"')
        + criterion('vector = "v_B"', "v_B").replace("1.0", "3.0")
        + criterion('link = "AB"', "AB")
    )
    assert found.points == {"v_A": 2.5, "v_B": 7.5, "AB": 1.0}
    assert found.max_score == 11.0
    assert [one.section for one in found.criterion] == ["velocity_plan", "velocity_plan", "mechanism"]


def test_bands_give_several_steps_and_none_all_or_nothing(rubric):
    steps = "[{ factor = 1.5, share = 0.75 }, { factor = 3, share = 0.25 }]"
    found = rubric(f"[tolerance]\nbands = {steps}\n" + criterion('vector = "v_A"')).tolerance
    assert found.all_bands == ((1.5, 0.75), (3.0, 0.25))
    assert found.farthest == 3.0
    assert ToleranceTable().all_bands == ((2.0, 0.5),)
    assert ToleranceTable(bands=[]).all_bands == ()
    assert ToleranceTable(bands=[]).farthest == 1.0


def test_a_criterion_may_follow_through_or_not_whatever_the_rubric_says(rubric):
    found = rubric(
        "follow_through = false\n"
        + criterion('vector = "v_A"\nfollow_through = true')
        + criterion('vector = "v_B"', "v_B")
    )
    assert [found.follows_through(one) for one in found.criterion] == [True, False]


def test_an_assignment_with_a_rubric_of_another_mechanism_is_refused(tmp_path):
    text = (library() / "press.assignment.toml").read_text(encoding="utf-8")
    path = tmp_path / "mixed.assignment.toml"
    path.write_text(text.replace('rubric = "press"', 'rubric = "pump"'), encoding="utf-8")
    with pytest.raises(AuthoredFileError, check=tells("no drawing of this assignment has v_CA")):
        rubric_of(load_assignment(str(path)))


def test_a_rate_is_not_asked_for_where_no_page_shows_its_plan():
    forces = load_assignment("pump-forces")
    rubric = rubric_of(forces)
    last = rubric.criterion[-1].model_copy(update={"angular": "omega_2", "moment": None})
    asked = rubric.model_copy(update={"criterion": [*rubric.criterion, last]})
    (fault,) = check_rubric(asked, construction_for(forces))
    assert clause(fault, ENGLISH) == "no drawing of this assignment has omega_2"


def test_an_unknown_rubric_is_a_wrong_call():
    with pytest.raises(CallError, check=tells("no rubric 'none'")):
        load_rubric("none")


def test_a_rubric_file_that_is_not_there_is_told(tmp_path):
    with pytest.raises(AuthoredFileError, check=tells("no such file")):
        load_rubric(str(tmp_path / "none.toml"))


@pytest.mark.parametrize("name", built_in())
def test_every_built_in_assignment_has_a_rubric_in_three_languages(name):
    found = rubric_of(load_assignment(name))
    for one in found.criterion:
        assert all(one.title.in_language(language) for language in ("en", "ro", "ru"))
        assert one.title.ro
        assert one.title.ru
