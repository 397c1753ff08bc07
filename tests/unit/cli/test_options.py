"""A record of options is all that the command line, planmark.toml and a run's note are made of."""

from dataclasses import fields
from pathlib import Path

from typer.main import get_command

from grader.cli.commands import app
from grader.folder.batch import Batch
from grader.folder.changes import RunNote, earlier_run, note_run
from grader.lms.grades import Options
from grader.options import (
    CheckOptions,
    ClassOptions,
    CycleOptions,
    ExportCall,
    ExportOptions,
    GradeOptions,
    PlanOptions,
    ReviewOptions,
    ServeOptions,
    offered,
    taken,
)
from grader.tables.class_file import ClassFile

RECORDS = {
    "plan": PlanOptions, "cycle": CycleOptions, "check": CheckOptions, "grade": GradeOptions,
    "export": ExportCall, "review": ReviewOptions, "serve": ServeOptions,
}  # fmt: skip


def test_commands_offer_what_their_records_have_with_its_help():
    commands = get_command(app).commands
    for name, record in RECORDS.items():
        options = {one.name: one for one in commands[name].params}
        for one, told in offered(record):
            assert options[one.name].help == told.help
            assert options[one.name].required == (one.name == "to" and name == "export")


def test_the_keys_of_a_class_file_are_those_of_the_records():
    keys = {told.key for record in (GradeOptions, ExportCall) for _, told in offered(record) if told.key}
    assert keys <= ClassFile.model_fields.keys()
    assert ClassFile.model_fields.keys() - keys == {"assignment", "out", "log"}


def test_who_heeds_or_keeps_options_has_all_of_the_record():
    for record, others in ((ClassOptions, (Batch, RunNote)), (ExportOptions, (Options, ExportCall))):
        for other in others:
            assert {one.name for one in fields(record)} <= {one.name for one in fields(other)}


def test_a_note_gives_the_options_of_the_run_again(tmp_path):
    given = ClassOptions(
        roster=tmp_path / "r.csv", pages_per_student=2, lang="ro", level="hint", with_ghosts=False
    )
    note = RunNote("pump", tmp_path, tmp_path / "out", **taken(ClassOptions, given))
    folder = tmp_path / "out" / ".planmark"
    folder.mkdir(parents=True)
    note_run(note, folder)
    again = earlier_run(Path(tmp_path / "out"))
    assert taken(ClassOptions, again) == taken(ClassOptions, given)
