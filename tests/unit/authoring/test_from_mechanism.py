"""Assignments made from a mechanism's own file."""

import re
from pathlib import Path

import pytest

from grader.authoring.lint import lint
from grader.authoring.new import new_assignment, starts, starts_folder
from grader.rubric import load_rubric, rubric_of
from reference.authored.assignment import load_assignment
from reference.errors import AuthoredFileError, CallError
from reference.plan import construction_for
from tests.conveyor import MECHANISM
from tests.told import tells

SIX_BAR = MECHANISM.replace("rpm = 120", 'rpm = "n1"').replace('side = "left"', 'side = "side_B"')
SIX_BAR = (
    SIX_BAR.replace('ru = "Конвейер"\n', "")
    .replace("Conveyor", "Six-bar")
    .replace("Transportor", "Mecanism cu șase elemente")
)
TABLE = "n,a [mm],d [mm],phi [deg],n1 [rpm],side_B\n1,85,260,290,120,left\n4,90,240,165,150,left\n"


def written(folder: Path, text: str = SIX_BAR, table: str | None = TABLE) -> tuple[Path, Path | None]:
    path = folder / "mine.mechanism.toml"
    path.write_text(text, encoding="utf-8")
    if table is None:
        return path, None
    (folder / "data.csv").write_text(table, encoding="utf-8")
    return path, folder / "data.csv"


def test_an_assignment_of_a_mechanism_and_a_table_has_no_fault_and_no_warning(tmp_path):
    mechanism, table = written(tmp_path)
    new = new_assignment(tmp_path / "course" / "six", mechanism=str(mechanism), table=table)
    assignment = load_assignment(new.assignment)
    assert [variant.n for variant in assignment.variants()] == [1, 4]
    result = lint(assignment, rubric_of(assignment))
    assert {finding.severity for finding in result.findings} <= {"hint"}
    assert "round_scales" not in {finding.code for finding in result.findings}
    assert assignment.mechanism_file.id == "six"
    given = {datum.label: value for datum, value in assignment.given(assignment.variants()[0])}
    told = {"O1A": 85.0, "AB": 210.0, "O2B": 165.0, "BC": 320.0, "x(O2)": 260.0, "n": 120.0}
    assert told.items() <= given.items()


def test_coordinates_of_a_point_of_a_link_are_given_with_the_line_along_which_they_count(tmp_path):
    point = '\n[[group]]\ntype = "point"\nnode = "K"\nbase = ["A", "B"]\nlink = "2"\nat = [-40, 12]\n'
    mechanism, table = written(tmp_path, SIX_BAR + point)
    new = new_assignment(tmp_path / "six", mechanism=str(mechanism), table=table)
    assignment = load_assignment(new.assignment)
    given = {datum.label: value for datum, value in assignment.given(assignment.variants()[0])}
    assert (given["x(K, A→B)"], given["y(K, A→B)"]) == (-40.0, 12.0)


def test_of_the_driving_link_what_is_given_is_not_asked(tmp_path):
    mechanism, table = written(tmp_path, SIX_BAR.replace('rpm = "n1"', 'rpm = "n1"\nepsilon = 3'))
    new = new_assignment(tmp_path / "six", mechanism=str(mechanism), table=table)
    asked = {one.turning for one in rubric_of(load_assignment(new.assignment)).criterion}
    assert asked & {"omega_1", "epsilon_1"} == {"omega_1"}


@pytest.mark.parametrize("near_dead_point", [1, 3])
def test_vectors_too_short_in_most_variants_are_criteria_behind_comment_signs(tmp_path, near_dead_point):
    """Two variants, and some near the dead point, 33.85 degrees."""
    more = "".join(f"{7 + row},85,260,{35 + row / 10},120,left\n" for row in range(near_dead_point))
    mechanism, table = written(tmp_path, table=TABLE + more)
    new = new_assignment(tmp_path / "six", mechanism=str(mechanism), table=table)
    assignment = load_assignment(new.assignment)
    rubric = rubric_of(assignment)
    asked = {criterion.vector for criterion in rubric.criterion} - {None}
    vectors = {name for name, vector in construction_for(assignment).vectors.items() if not vector.is_sum}
    found = [one for one in lint(assignment, rubric).findings if one.code.startswith("short_")]
    assert {one.severity for one in found} == {"hint"}
    told = " ".join(one.message() for one in found)
    assert "a_B_n" in told
    if near_dead_point == 1:
        assert asked == vectors
        return
    assert asked < vectors
    assert all(f"{name} (3/5, " in told for name in vectors - asked)
    text = new.rubric.read_text(encoding="utf-8")
    before, _, behind = text.partition("# Not asked for")
    blocks = re.sub("(?m)^# ", "", behind.partition("\n\n")[2])
    new.rubric.write_text(before + blocks, encoding="utf-8")
    everything = load_rubric(new.rubric)
    assert {criterion.vector for criterion in everything.criterion} - {None} == vectors


def test_titles_are_those_of_the_mechanism_in_its_languages(tmp_path):
    mechanism, table = written(tmp_path)
    new = new_assignment(tmp_path / "course" / "six", mechanism=str(mechanism), table=table)
    title = load_assignment(new.assignment).file.title
    assert (title.ro, title.ru) == ("Mecanism cu șase elemente: viteze și accelerații", None)
    rubric = rubric_of(load_assignment(new.assignment))
    titles = {criterion.id: criterion.title for criterion in rubric.criterion}
    assert titles["a_CB_t"].en == "Tangential acceleration of C relative to B"
    assert titles["a_B_n"].ru == "Нормальное ускорение точки B"


def test_a_file_that_lies_there_under_its_name_stays(tmp_path):
    mechanism, table = written(tmp_path)
    before = mechanism.read_bytes()
    new_assignment(tmp_path / "mine", mechanism=str(mechanism), table=table)
    assert mechanism.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "data.csv", "mine.assignment.toml", "mine.mechanism.toml", "mine.rubric.toml",
    ]  # fmt: skip


@pytest.mark.parametrize("name", starts())
def test_every_kind_of_group_is_titled_given_and_fits(name, tmp_path):
    """The starts' mechanisms, their formulas as numbers of one variant."""
    source = load_assignment(starts_folder() / f"{name}.assignment.toml")
    text = (starts_folder() / f"{name}.mechanism.toml").read_text(encoding="utf-8")
    values = source.values([source.variants()[9]])
    for key in sorted(values, key=len, reverse=True):
        text = text.replace(f'"{key}"', str(float(values[key][0])))
    (tmp_path / "own.mechanism.toml").write_text(text, encoding="utf-8")
    new = new_assignment(tmp_path / "own", mechanism=str(tmp_path / "own.mechanism.toml"))
    assignment = load_assignment(new.assignment)
    result = lint(assignment, rubric_of(assignment))
    assert {finding.severity for finding in result.findings} <= {"hint"}, result.findings


@pytest.mark.parametrize(
    ("text", "table", "error", "message"),
    [
        (SIX_BAR, None, CallError, "give the values of a, d, n1, phi, side_B by a CSV"),
        (
            SIX_BAR.replace('"RRR"', '"RRX"'),
            TABLE,
            AuthoredFileError,
            r"group\[0\].type: 'RRX' is no type",
        ),
        (SIX_BAR, "n,a [mm]\n1,85\n", AuthoredFileError, r"(?s)mine\.mechanism\.toml:.*unknown name"),
        (SIX_BAR.replace("210, 165", "21, 16"), TABLE, CallError, "no variant of it assembles"),
    ],
)
def test_what_cannot_be_made_is_told_and_nothing_is_written(text, table, error, message, tmp_path):
    mechanism, beside = written(tmp_path, text, table)
    with pytest.raises(error, check=tells(message)):
        new_assignment(tmp_path / "course" / "six", mechanism=str(mechanism), table=beside)
    assert not (tmp_path / "course").exists()
