"""``planmark collect``."""

import os
from dataclasses import replace
from pathlib import Path

from grader.cli import terminal
from grader.cli.app import progress
from grader.cli.terminal import gettext, note
from grader.folder.batch import graded, noted_batch
from grader.folder.collect import LOOK, PAGES, check_scans, check_target, collect
from grader.language import N_
from grader.lms.export import read_results
from grader.lms.grades import in_a_row

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
        told = N_("pages written to %(file)s: %(count)s; the preview in %(folder)s can be removed")
        note(gettext(told, count=done.given, file=file, folder=done.preview))
        return False
    if done.left_out:
        told = N_("pages left out, since no figure was read or one lies where the title block is: %(count)s")
        note(gettext(told, count=done.left_out))
    waiting = in_a_row(done.waiting, NAMED, terminal.speaker())
    terminal.say(gettext("Nothing is written yet. Check %(names)s:", names=waiting))
    told = N_("open %(page)s, answer for each page in %(file)s,\nthen run the same command again.")
    terminal.say(gettext(told, page=done.preview / LOOK, file=done.preview / PAGES))
    return True
