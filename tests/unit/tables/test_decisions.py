"""decisions.csv: what people wrote is understood or refused with its line; nobody's row is lost."""

import multiprocessing
import re
import threading
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader.tables.decision_texts import PageDecision, page_decision, place, place_text
from grader.tables.decisions import COLUMNS, VERDICTS, ClashError, Decision, DecisionFile, read_table
from grader.tables.reader import TableError
from grader.texts.spoken import fault, lines_of
from reference.errors import InputFileError, PlanmarkError
from tests.examples import examples

HEADER = ",".join(COLUMNS)
ROW = Decision(
    "s07", None, "a_D", "partial", 1.5, "arrow missing", "S. Popa", "2026-11-22T18:00:00+02:00", "b1"
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "decisions.csv"


def written(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    return path


def read_decisions(path):
    """The rows of a file without faults."""
    table = read_table(path)
    assert table.faults == ()
    return table.rows


def unlined(rows):
    return [replace(row, line=0) for row in rows]


# What people write --------------------------------------------------------------------------------


def test_a_row_of_every_kind_is_read(path):
    lines = [
        HEADER,
        's07,,a_D,full,,"well, yes",S. Popa,2026-11-22T18:00:00+02:00,b12',
        's07,2,node:velocity_plan:c,"61.25,140.5",,,,,',
        ',,page:class.pdf#3,"owner=s03; turn=90; corners=1,2 9,2 9,8 1,8",,,,,',
        "s08,,total,,-1.5,late,,,",
        "s09,,comment,,,Tidy work.,,,",
    ]
    verdict, node, page, total, comment = read_decisions(written(path, "\n".join(lines)))
    assert verdict == Decision(
        "s07", None, "a_D", "full", None, "well, yes", "S. Popa", "2026-11-22T18:00:00+02:00", "b12", 2
    )
    assert (node.position, node.node, node.place) == (2, ("velocity_plan", "c"), (61.25, 140.5))
    assert page.page == PageDecision("s03", 90, ((1, 2), (9, 2), (9, 8), (1, 8)))
    assert (page.scan.file, page.scan.page) == ("class.pdf", 3)
    assert (total.points, total.comment, comment.comment) == (-1.5, "late", "Tidy work.")
    assert [row.kind for row in (verdict, node, page, total, comment)] == [
        "verdict", "node", "page", "total", "comment",
    ]  # fmt: skip


def test_no_file_is_no_decision(path):
    assert read_decisions(path) == []
    assert read_decisions(written(path, "\n \n")) == []


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_spreadsheets_file_has_semicolons_decimal_commas_and_blank_lines(path, encoding):
    text = "student_id;criterion;verdict;points;comment\r\n;;;;\r\ns07;v_B;Partial;1,5;așa e\r\n\r\n;;;;\r\n"
    (row,) = read_decisions(written(path, text, encoding))
    assert (row.verdict, row.points, row.comment, row.line) == ("partial", 1.5, "așa e", 3)


@pytest.mark.parametrize(
    ("line", "where", "what"),
    [
        ("s07,,a_D,excellent,,,,,", "line 2, verdict", "none of full"),
        ("s07,,a_D,,2,,,,", "line 2, verdict", "none of full"),
        (",,a_D,full,,,,,", "line 2, student_id", "whose submission"),
        ("../x,,a_D,full,,,,,", "line 2, student_id", "refused"),
        ("s07,two,a_D,full,,,,,", "line 2, position", "not a whole number"),
        ('s07,,a_D,full,"1,5",,,,', "line 2, points", "decimal point"),
        ("s07,,a_D,full,nan,,,,", "line 2, points", "no number"),
        ("s07,,a_D,none,-1,,,,", "line 2, points", "below 0"),
        ("s07,,node:velocity_plan:c,61.25,,,,,", "line 2, verdict", "two numbers"),
        ('s07,,node:c,"1.0,2.0",,,,,', "line 2, criterion", "node:FIGURE:NODE"),
        (",,page:class.pdf#0,turn=90,,,,,", "line 2, criterion", "page"),
        (",,page:class.pdf#1,turn=45,,,,,", "line 2, verdict", "turn '45'"),
        (",,page:class.pdf#1,,,,,,", "line 2, verdict", "owner=STUDENT"),
        (',,page:class.pdf#1,"corners=1,2 9,2 9,8",,,,,', "line 2, verdict", "four"),
        (',,page:class.pdf#1,"corners=1,2 1,8 9,8 9,2",,,,,', "line 2, verdict", "clockwise"),
        ("s07,,total,,,,,,", "line 2, points", "is empty"),
        ("s07,,comment,,,,,,", "line 2, comment", "is empty"),
        ("s07,,comment,,1,x,,,", "line 2, points", "must be empty"),
        ("s07,,a_D,full,,a,b,c,d,e", "line 2", "10 fields"),
    ],
)  # fmt: skip
def test_a_line_that_cannot_be_used_is_told_and_the_others_are_read(path, line, where, what):
    written(path, f"{HEADER}\n{line}\ns01,,v_B,none,,,,,\n")
    table = read_table(path)
    assert re.search(rf"(?s){where}: .*{what}", lines_of([fault(one) for one in table.faults]))
    assert [row.student_id for row in table.rows] == ["s01"]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (f"{HEADER},mood\ns07,,a_D,full,,,,,,fine", "line 1: column 'mood' is not known; remove it"),
        ("student_id,criterion,verdict,coment\n", "did you mean comment"),
        ("student_id,criterion\n", "column verdict is missing"),
        ("student_id,criterion,verdict,verdict\n", "2 times"),
        (f'{HEADER}\ns07,,a_D,full,,"open', "check its quotes"),
    ],
)
def test_a_fault_of_the_whole_file_says_what_to_do(path, text, what):
    with pytest.raises(InputFileError, match=what):
        DecisionFile(written(path, text)).all()


def test_a_cell_beside_the_named_columns_is_told(path):
    written(path, "student_id,criterion,verdict,\ns07,a_D,full,but late\ns07,a_B,full,\n")
    table = read_table(path)
    assert [row.criterion for row in table.rows] == ["a_B"]
    assert "line 2: 'but late' stands in a column without a name" in fault(table.faults[0])


def test_the_same_decided_twice_is_not_guessed(path):
    written(path, f"{HEADER}\ns07,,a_D,full,,,,,\ns07,,a_D,none,,,,,\ns07,1,a_D,none,,,,,\n")
    table = read_table(path)
    assert [fault(one) for one in table.faults] == [
        "line 2, criterion: a_D is decided on line 3 too; leave one line of them",
        "line 3, criterion: a_D is decided on line 2 too; leave one line of them",
    ]
    assert [row.line for row in table.rows] == [4]


@pytest.mark.parametrize("text", ["61.25,140.5", "61.25, 140.5", "61.25 140.5", "61,25;140,5", "61,25 140,5"])
def test_a_place_is_read_as_spreadsheets_and_people_write_it(text):
    assert place(text) == (61.25, 140.5)


@given(x=st.floats(-1e4, 1e4), y=st.floats(-1e4, 1e4))
def test_a_place_reads_back_as_it_was_written(x, y):
    assert place(place_text(x, y)) == pytest.approx((x, y), abs=6e-4)


def test_a_pages_decision_reads_back_as_it_was_written():
    for one in (
        PageDecision("s03"), PageDecision(turn=0),
        PageDecision("s03", 270, ((0.5, 0.0), (9.0, 0.0), (9.0, 8.0), (0.0, 8.0))),
    ):  # fmt: skip
        assert page_decision(str(one)) == one


# What the program writes --------------------------------------------------------------------------


def test_what_is_added_is_read_again_in_the_order_of_adding(path):
    file = DecisionFile(path)
    assert file.add(ROW, replace(ROW, criterion="a_B")) == []
    assert file.add(replace(ROW, student_id="s08")) == []
    assert [(row.student_id, row.criterion, row.line) for row in file.all()] == [
        ("s07", "a_D", 2), ("s07", "a_B", 3), ("s08", "a_D", 4),
    ]  # fmt: skip
    assert path.read_bytes().startswith(b"\xef\xbb\xbfstudent_id,position,")


def test_a_decision_stands_in_the_place_of_the_earlier_one(path):
    file = DecisionFile(path)
    file.add(ROW, replace(ROW, criterion="a_B"))
    new = replace(ROW, verdict="full", points=None)
    assert file.add(new) == [ROW]
    assert unlined(file.all()) == [new, replace(ROW, criterion="a_B")]


def test_one_page_is_decided_once_whoever_it_is_of(path):
    file = DecisionFile(path)
    file.add(Decision("", None, "page:s07.jpg", "turn=90"))
    file.add(Decision("s07", 2, "page:s07.jpg#1", "turn=180"))
    assert [row.verdict for row in file.all()] == ["turn=180"]


def test_undo_puts_back_what_was_there(path):
    file = DecisionFile(path)
    file.add(ROW)
    new = replace(ROW, verdict="none", points=None)
    before = file.add(new)
    file.remove(new, restored=before)
    assert unlined(file.all()) == [ROW]
    file.remove(ROW)
    assert file.all() == []


def test_a_row_that_somebody_else_changed_is_a_clash(path):
    one, other = DecisionFile(path), DecisionFile(path)
    one.add(ROW)
    seen = one.all()
    other.add(replace(ROW, verdict="full", points=None, by="other"))
    with pytest.raises(ClashError) as clash:
        one.add(replace(ROW, verdict="none"), expected=seen)
    assert [row.by for row in clash.value.rows] == ["other"]
    with pytest.raises(ClashError):
        one.remove(ROW)
    assert [row.by for row in one.all()] == ["other"]
    one.add(replace(ROW, verdict="none"), expected=one.all())
    assert one.all()[0].verdict == "none"


def test_two_people_deciding_different_things_do_not_clash(path):
    one, other = DecisionFile(path), DecisionFile(path)
    seen = one.all()
    other.add(replace(ROW, criterion="a_B"))
    one.add(ROW, expected=seen)
    assert len(one.all()) == 2


def test_a_row_taken_back_by_somebody_else_is_a_clash(path):
    file = DecisionFile(path)
    file.add(ROW)
    seen = file.all()
    file.remove(ROW)
    with pytest.raises(ClashError) as clash:
        file.add(replace(ROW, verdict="full"), expected=seen)
    assert clash.value.rows == ()


def test_what_could_not_be_read_again_is_not_written(path):
    file = DecisionFile(path)
    for bad in (
        replace(ROW, verdict="great"),
        replace(ROW, comment="\x00"),
        replace(ROW, points=float("nan")),
    ):
        with pytest.raises(TableError, match="a_D: "):
            file.add(replace(ROW, criterion="a_B"), bad)
    assert not path.exists()


def test_lines_that_cannot_be_used_stay_in_the_file(path):
    written(path, f"{HEADER}\ns07,,a_D,excellent,,keep me,,,\n")
    file = DecisionFile(path)
    file.add(replace(ROW, criterion="a_B"))
    assert "keep me" in path.read_text("utf-8")
    assert len(read_table(file.path).faults) == 1
    file.add(ROW)  # settles what the line was about
    assert "keep me" not in path.read_text("utf-8")


def test_a_spreadsheets_form_is_kept(path):
    written(path, "\ufeffstudent_id;criterion;verdict;points\r\ns07;v_B;partial;1,5\r\n")
    file = DecisionFile(path)
    file.add(replace(ROW, points=0.25))
    text = path.read_text("utf-8")
    assert text.startswith("\ufeffstudent_id;position;")
    assert "s07;;v_B;partial;1,5;" in text
    assert "s07;;a_D;partial;0,25;" in text
    assert [row.points for row in file.all()] == [1.5, 0.25]


@pytest.mark.parametrize(("text", "points"), [("5e-324", 0.0), ("-1e-9", 0.0), ("0.1234567", 0.123457)])
def test_points_are_read_to_the_decimals_that_are_written(path, text, points):
    file = DecisionFile(written(path, f"{HEADER}\ns1,,total,,{text},late,,,\n"))
    before = file.all()
    file.add(ROW)
    assert unlined(file.all()[:1]) == unlined(before)
    assert before[0].points == points


def test_a_comment_is_no_formula_in_a_spreadsheet(path):
    file = DecisionFile(path)
    file.add(replace(ROW, comment="=1+1"), replace(ROW, criterion="a_B", comment="'-so"))
    assert "'=1+1" in path.read_text("utf-8")
    assert [row.comment for row in file.all()] == ["=1+1", "'-so"]


def test_a_place_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(PlanmarkError, match="cannot be written"):
        DecisionFile(tmp_path / "file" / "decisions.csv").add(ROW)


texts = st.text(max_size=30).filter(
    lambda text: not set(text) & {*map(chr, range(32)), "\x7f"} - set("\t\r\n")
)
decisions = st.builds(
    Decision,
    student_id=st.sampled_from(["s01", "s02", "A.b-c_9"]),
    position=st.none() | st.integers(0, 99),
    criterion=st.sampled_from(["a_D", "v_B", "omega_2"]),
    verdict=st.sampled_from(VERDICTS),
    points=st.none() | st.floats(0, 1000).map(lambda points: round(points, 6)),
    comment=texts.map(str.strip),
    by=texts.map(str.strip),
    at=texts.map(str.strip),
    basis=texts.map(str.strip),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=examples(60))
@given(rows=st.lists(decisions, max_size=6, unique_by=lambda row: row.key), mark=st.sampled_from(",;"))
def test_any_decision_reads_back_as_it_was_written(tmp_path, rows, mark):
    path = written(tmp_path / "any.csv", HEADER.replace(",", mark))
    DecisionFile(path).add(*rows)
    assert unlined(read_decisions(path)) == rows


# Several at once ----------------------------------------------------------------------------------


def add_many(path, who):
    file = DecisionFile(path)
    for number in range(15):
        file.add(replace(ROW, student_id=who, criterion=f"c{number}"))


def test_threads_and_processes_lose_nothing(path):
    spawn = multiprocessing.get_context("spawn")
    workers = [spawn.Process(target=add_many, args=(path, f"p{number}")) for number in range(2)]
    workers += [threading.Thread(target=add_many, args=(path, f"t{number}")) for number in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(read_decisions(path)) == 5 * 15


def add_and_tell(path, pipe):
    file = DecisionFile(path)
    for number in range(10_000):
        file.add(replace(ROW, criterion=f"c{number}"))
        pipe.send(number)


def test_what_was_accepted_is_there_after_the_process_was_killed(path):
    spawn = multiprocessing.get_context("spawn")
    receiving, sending = spawn.Pipe(duplex=False)
    worker = spawn.Process(target=add_and_tell, args=(path, sending))
    worker.start()
    accepted = [receiving.recv() for _ in range(12)]
    worker.kill()
    worker.join()
    there = {row.criterion for row in read_decisions(path)}
    assert {f"c{number}" for number in accepted} <= there
    DecisionFile(path).add(ROW)  # the lock went with the process
    assert len(read_decisions(path)) == len(there) + 1
