"""``planmark collect``."""

import os
from dataclasses import replace
from pathlib import Path

from grader.cli import terminal
from grader.cli.app import progress
from grader.cli.terminal import note
from grader.folder.batch import graded, noted_batch
from grader.folder.collect import LOOK, PAGES, check_scans, check_target, collect
from grader.lms.export import read_results
from grader.lms.grades import in_a_row
from reference.errors import counted

NAMED = 6
"""Pages named of those that wait."""


def collect_class(folder: Path, file: Path, jobs: int | None) -> bool:
    """Make the preview of what would be given away, or write it; whether a person must look."""
    check_target(file)
    batch = replace(noted_batch(folder), jobs=jobs or os.cpu_count() or 1)
    check_scans(batch, read_results(batch.out).reports)
    with progress() as tell:
        done = collect(batch, graded(batch, tell), file)
    if done.given is not None:
        note(f"{counted(done.given, 'page')} written to {file}; the preview in {done.preview} can be removed")
        return False
    if done.left_out:
        count = counted(done.left_out, "page")
        note(f"{count} left out: no figure was read, or one lies where the title block is")
    terminal.say(f"Nothing is written yet. Check {in_a_row(done.waiting, NAMED)}:")
    terminal.say(f"open {done.preview / LOOK}, answer for each page in {done.preview / PAGES},")
    terminal.say("then run the same command again.")
    return True
