"""The program as a user calls it, from another folder."""

import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests import inline
from tests.waiting import PATIENCE_S

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = (sys.executable, "-u", "-m", "grader")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "COLUMNS": "120"}
Run = Callable[..., CompletedProcess[str]]


@pytest.fixture
def planmark(tmp_path: Path) -> Run:
    """Runs ``planmark ...`` in an empty folder."""
    return partial(inline.planmark, cwd=tmp_path)


def start(folder: Path, *arguments: object, **variables: str) -> subprocess.Popen[str]:
    """The program as a process, in a group of its own; variables of its environment by name."""
    return subprocess.Popen(  # noqa: S603 - our own program
        [*PROGRAM, *map(str, arguments)], cwd=folder, env=ENVIRONMENT | variables, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, encoding="utf-8", start_new_session=True,
    )  # fmt: skip


def run(folder: Path, *arguments: object, **variables: str) -> CompletedProcess[str]:
    """The program as a process, from its start to its end."""
    with start(folder, *arguments, **variables) as process:
        out, err = process.communicate(timeout=PATIENCE_S)
    return CompletedProcess(arguments, process.returncode, out, err)
