"""The published JSON Schemas: of every document that enters or leaves, and of the authored files."""

from typing import Any, Literal

from pydantic import BaseModel

from grader.documents import (
    SCHEMA_VERSION,
    CalibrationDocument,
    LintDocument,
    MeasurementsDocument,
    PlanDocument,
    ReadingDocument,
    ReportDocument,
    ResultsDocument,
)
from grader.lms.canvas import CanvasMarksDocument
from grader.lms.moodle_guide import MoodleMarksDocument, MoodleRubricDocument
from grader.lms.scores import GradescopeDocument, LtiDocument
from grader.rubric import RubricFile
from reference.assignment_file import AssignmentFile
from reference.errors import CallError
from reference.mechanism_file import MechanismFile

MODELS: dict[str, tuple[type[BaseModel], Literal["validation", "serialization"]]] = {
    "measurements": (MeasurementsDocument, "validation"),
    "reading": (ReadingDocument, "serialization"),
    "report": (ReportDocument, "serialization"),
    "results": (ResultsDocument, "serialization"),
    "plan": (PlanDocument, "serialization"),
    "lint": (LintDocument, "serialization"),
    "calibration": (CalibrationDocument, "serialization"),
    "moodle-rubric": (MoodleRubricDocument, "serialization"),
    "moodle-marks": (MoodleMarksDocument, "serialization"),
    "canvas-marks": (CanvasMarksDocument, "serialization"),
    "gradescope": (GradescopeDocument, "serialization"),
    "lti": (LtiDocument, "serialization"),
    "mechanism": (MechanismFile, "validation"),
    "assignment": (AssignmentFile, "validation"),
    "rubric": (RubricFile, "validation"),
}


def schema_names() -> list[str]:
    """The names that `schema` knows."""
    return list(MODELS)


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a document or authored file; CallError for an unknown name."""
    if name not in MODELS:
        raise CallError("unknown_schema", f"there is no schema '{name}': known are {', '.join(MODELS)}")
    model, mode = MODELS[name]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:planmark:{name}:{SCHEMA_VERSION}",
        **model.model_json_schema(mode=mode),
    }
