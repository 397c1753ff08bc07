"""``planmark export``."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel

from grader import lms
from grader.cli import terminal
from grader.cli.terminal import gettext
from grader.documents import (
    SCHEMA_VERSION,
    CalibrationDocument,
    LintDocument,
    MeasurementsDocument,
    ReadingDocument,
    ReportDocument,
    ResultsDocument,
)
from grader.language import N_
from grader.lms.export import export as deliver
from grader.lms.export import read_results, usual_name
from grader.lms.grades import Delivery, Options, people_of
from grader.lms.send import SentDocument
from grader.lms.table import with_ids
from grader.options import ExportCall, ExportOptions, taken
from grader.rubric import RubricFile
from grader.solution.document import PlanDocument
from grader.texts.spoken import clause, failure
from reference.authored.assignment import AssignmentFile
from reference.authored.mechanism import MechanismFile
from reference.errors import CallError

MODELS: dict[str, tuple[type[BaseModel], Literal["validation", "serialization"]]] = {
    "measurements": (MeasurementsDocument, "validation"),
    "reading": (ReadingDocument, "serialization"),
    "report": (ReportDocument, "serialization"),
    "results": (ResultsDocument, "serialization"),
    "plan": (PlanDocument, "serialization"),
    "lint": (LintDocument, "serialization"),
    "calibration": (CalibrationDocument, "serialization"),
    "mechanism": (MechanismFile, "validation"),
    "assignment": (AssignmentFile, "validation"),
    "rubric": (RubricFile, "validation"),
    "sent": (SentDocument, "serialization"),
}
WRITTEN = {path.stem: path for path in sorted((Path(lms.__file__).parent / "schemas").glob("*.json"))}
"""The schemas of what is only written: documents that platforms take."""


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a document or authored file; CallError for an unknown name."""
    if name in WRITTEN:
        written: dict[str, Any] = json.loads(WRITTEN[name].read_bytes())
        return written
    if name not in MODELS:
        raise failure(CallError, "unknown_schema", text=name, names=(*MODELS, *WRITTEN))
    model, mode = MODELS[name]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:planmark:{name}:{SCHEMA_VERSION}",
        **model.model_json_schema(mode=mode),
    }


def export_results(folder: Path, call: ExportCall) -> tuple[bool, Path]:
    """Write the export file and report who is not in it; whether anybody is missing, and the file."""
    if call.worksheet is not None and (call.gradebook is not None or call.to != "moodle"):
        raise failure(CallError, "option_unused", "worksheet_of_moodle")
    if call.gradebook is not None and call.to in {"moodle", "canvas-api"}:
        raise failure(CallError, "option_unused", option="--gradebook", what=call.to)
    options = Options(form=call.worksheet or call.gradebook, out=folder, **taken(ExportOptions, call))
    path = call.file or (folder if call.to == "json" else folder / usual_name(options))
    sources = (options.form, options.criteria, options.submissions, call.roster, call.ids)
    for source in (folder / "results.json", *sources):
        if source is not None and path.resolve() == source.resolve():
            raise failure(CallError, "file_exists", "read_for_export", file=path)
    results = read_results(folder)
    people = {} if call.roster is None else people_of(call.roster)
    if call.ids is not None:
        people = with_ids(people, call.ids)
    delivery = deliver(results, path, replace(options, people=people))
    terminal.speak(options.lang or results.lang or "en")
    _report(delivery, path)
    return not delivery.is_complete, path


LABELS = {
    "withheld": N_("withheld"), "unplaced": N_("no place in the file"), "note": N_("note"),
}  # fmt: skip


def _report(delivery: Delivery, path: Path) -> None:
    speaker = terminal.speaker()
    ngettext = speaker.ngettext
    words = {name: gettext(text) for name, text in LABELS.items()}
    is_of_students = delivery.written or delivery.withheld or delivery.unplaced
    num, told = len(delivery.written), gettext("written to %(file)s", file=path)
    if is_of_students:
        many = ngettext("%(num)d student written to %(file)s", "%(num)d students written to %(file)s", num)
        told = many % {"num": num, "file": path}
    terminal.note(told)
    for student, label, reasons in delivery.left_out():
        why = ", ".join(clause(reason, speaker) for reason in reasons)
        terminal.say(f"  {student}: {words[label]}: {why}")
    for note in delivery.notes:
        terminal.say(f"  {words['note']}: {clause(note, speaker)}")
