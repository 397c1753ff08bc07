"""What is ready to be written, and documents checked on the way there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from grader.lms.archive import Content
from grader.lms.faults import faults_of, listed, not_as_meant
from grader.lms.grades import Grade
from reference.errors import InputFileError

Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Draft:
    """An export before it is written.

    Attributes
    ----------
    content : the file's; of several files by their names, for an archive or a folder
    written : students with a grade in it
    withheld : students without one, with why (they wait for a person, or handed in nothing)
    not_found : students for whom the platform's file has no place, with why
    notes : what the person who uploads it should know
    """

    content: str | bytes | Content
    written: tuple[str, ...]
    withheld: Mapping[str, str] = field(default_factory=dict)
    not_found: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def withheld(grades: Sequence[Grade]) -> dict[str, str]:
    """Who has no grade yet, with why."""
    return {grade.student_id: grade.withheld for grade in grades if grade.score is None}


def ready(grades: Sequence[Grade]) -> list[Grade]:
    """The grades that can be told."""
    return [grade for grade in grades if grade.score is not None]


def document(model: type[Model], told: Mapping[str, object], where: str) -> Model:
    """A document that holds to its model; InputFileError with everything that does not."""
    try:
        return model.model_validate(told)
    except ValidationError as error:
        raise InputFileError(
            "export_refused",
            f"{where} would not be what the platform takes; nothing was written{listed(faults_of(error))}",
        ) from error


def json_text(one: BaseModel) -> str:
    """A document as JSON, without what is not told; read back once."""
    text = one.model_dump_json(indent=2, exclude_none=True)
    if type(one).model_validate_json(text) != one:
        raise not_as_meant("the document")
    return text + "\n"
