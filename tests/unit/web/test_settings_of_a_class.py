"""An instructor's settings are made from the record of options: its bounds, choices and helps."""

import pytest
from pydantic import ValidationError

from grader.options import ExportOptions, PublicationOptions, offered
from grader.web.instructors import CHOSEN, Chosen, Settings


def test_the_settings_are_those_of_the_record_with_its_helps():
    of_record = {one.name: told.help for one, told in offered(PublicationOptions)}
    assert {name: one.description for name, one in Settings.model_fields.items()} == of_record
    exported = {one.name: told.help for one, told in offered(ExportOptions)}
    assert {name: one.description for name, one in Chosen.model_fields.items()} == {
        name: exported[name] for name in CHOSEN
    }


@pytest.mark.parametrize(
    "wrong",
    [
        {"lang": "de"}, {"level": "full"}, {"pages_per_student": 21}, {"attempts": -1}, {"term": "2026\n"},
        {"title": "a\0b"}, {"title": 121 * "a"}, {"key": "x"},
    ],
)  # fmt: skip
def test_what_the_record_does_not_allow_is_refused(wrong):
    with pytest.raises(ValidationError):
        Settings.model_validate(wrong)


def test_what_is_left_out_is_none():
    assert Settings(lang="ro").model_dump(exclude_none=True) == {"lang": "ro"}
