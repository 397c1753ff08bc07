"""Any file at any door: it is taken, or refused with a documented code; nothing else is raised."""

import json
import random
import re
import tomllib
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.examples import examples
from tests.fuzz.doors import enter, mutated
from tests.fuzz.seeds import seeds
from tests.fuzz.shaped import shaped

DOCUMENTED = "".join(path.read_text("utf-8") for path in (Path(__file__).parents[2] / "docs").glob("*.md"))
KINDS = {
    "JPEG": ("pictures", b"\xff\xd8\xff"),
    "PNG": ("pictures", b"\x89PNG\r\n\x1a\n"),
    "TIFF": ("pictures", b"II*\x00"),
    "PDF": ("pictures", b"%PDF-"),
    "TOML": ("authored", b"schema_version = 1\n"),
    "CSV of measurements": ("measurements", b"student_id,"),
    "JSON of measurements": ("measurements", b"{"),
    "CSV of a class": ("roster", b"student_id,"),
    "CSV of decisions": ("decisions", b"student_id,position,criterion,verdict,"),
}
"""By kind of file: its door, and how such a file begins."""
EXAMPLES = 25
"""Files of each kind in a run: all of them take a few seconds."""


@cache
def healthy(kind: str) -> list[bytes]:
    """Healthy files of the door; those of the very kind where files of it begin alike."""
    door, head = KINDS[kind]
    whole = seeds(door)
    return [data for data in whole if data.startswith(head)] or whole


def hand_in(kind: str, data: bytes) -> None:
    refused = re.match("([a-z_]+): ", enter(KINDS[kind][0], data))
    assert refused is None or f"`{refused[1]}`" in DOCUMENTED


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(EXAMPLES))
@given(data=st.binary(max_size=200))
def test_what_only_begins_like_a_file_is_taken_or_refused(kind, data):
    hand_in(kind, KINDS[kind][1] + data)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(EXAMPLES))
@given(seed=st.integers(0, 2**64 - 1))
def test_a_damaged_file_is_taken_or_refused(kind, seed):
    dice = random.Random(seed)
    hand_in(kind, mutated(dice.choice(healthy(kind)), dice.choice(healthy(kind)), dice))


@pytest.mark.parametrize(("door", "read"), [("results", json.loads), ("settings", tomllib.loads)])
def test_most_mutations_keep_the_form_and_change_what_it_holds(door, read):
    healthy_one, whole = seeds(door)[0], 0
    before = read(healthy_one.decode())
    for seed in range(100):
        with suppress(ValueError):  # another encoding, or a key of TOML that is there twice
            whole += read(shaped(healthy_one, random.Random(seed)).decode()) != before
    assert whole > 70
