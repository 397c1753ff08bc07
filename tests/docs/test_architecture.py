"""The table and the picture of the rooms are those of the folders: run `python -m docs.make_architecture`."""

import re

from docs import make_architecture as architecture


def test_the_table_of_rooms_is_that_of_the_folders():
    page = architecture.PAGE.read_text(encoding="utf-8")
    written = page.partition(architecture.FIRST)[2].partition(architecture.LAST)[0]
    assert written.strip() == architecture.table()


def test_the_picture_of_the_rooms_is_that_of_the_imports():
    assert architecture.PICTURE.read_text(encoding="utf-8") == architecture.picture()


def test_the_guide_to_changes_leads_to_files_that_are_there():
    page = architecture.PAGE.read_text(encoding="utf-8")
    guide = page.partition("## Where to change what")[2].partition("\n## ")[0]
    named = re.findall(r"`([\w/]+\.py)`", guide)
    assert len(named) > 10
    assert [name for name in named if not (architecture.ROOT / name).is_file()] == []


def test_no_room_is_above_its_ceiling():
    sizes, ceilings = architecture.sizes(), architecture.ceilings()
    assert sizes.keys() == ceilings.keys()
    assert {name: size for name, size in sizes.items() if size > ceilings[name]} == {}


def test_every_room_says_what_it_holds():
    assert not [room.name for room in architecture.rooms() if not room.holds]


def test_a_room_lies_above_what_it_imports_from_and_a_cycle_on_one_level():
    imports = {"cli": {"work", "words"}, "work": {"words", "more"}, "more": {"work"}, "words": set()}
    found = {name: frozenset(others) for name, others in imports.items()}
    assert architecture.levels(found) == {"words": 0, "work": 1, "more": 1, "cli": 2}


def test_the_picture_leaves_out_what_a_longer_way_says():
    imports = {"cli": frozenset({"work", "words"}), "work": frozenset({"words"}), "words": frozenset()}
    assert architecture.shortened(imports) == {"cli": {"work"}, "work": {"words"}, "words": set()}
