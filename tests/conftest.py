"""Fixtures and hooks that all tests share."""

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings

from tests.examples import FULL, PROFILE, examples

settings.register_profile("fresh", max_examples=examples(25), deadline=None)
settings.register_profile(
    "same",
    settings.get_profile("fresh"),
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],  # a failure is told at once, and shrunk by whoever mends it
    suppress_health_check=[HealthCheck.too_slow],
)
# Nobody's checkout fails by a draw that nobody else has; new ones are drawn where somebody asks for them.
settings.load_profile("fresh" if PROFILE == "fresh" else "same")

# Else each process that a test starts compiles the whole program again, and each worker all tests.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it starts in the background ignore Ctrl+C, and the programs that tests start with it.
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Let each worker go through whole files, so that what a file or a room shares is made once."""
    if getattr(config.option, "numprocesses", None) and config.option.dist == "no":
        config.option.dist = "worksteal"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark laws as slow where they are tried with all their examples: `-m slow` runs these, too.

    The coverage of laws is measured with a part of their examples; the simulation is no part of the program.
    """
    laws, simulation = (Path(__file__).parent / folder for folder in ("laws", "synthetic"))
    for item in items:
        is_law = item.path.is_relative_to(laws)
        if FULL and (is_law or hasattr(getattr(item, "obj", None), "hypothesis")):
            item.add_marker(pytest.mark.slow)
        if (FULL and is_law) or item.path.is_relative_to(simulation):
            item.add_marker(pytest.mark.no_cover)


@pytest.fixture(scope="session", autouse=True)
def no_waiting_for_the_disk() -> None:
    """Write without waiting for the disk: no test cuts the power, and a busy disk takes long."""
    os.fsync = lambda _file: None


@pytest.fixture(autouse=True)
def in_english() -> Iterator[None]:
    """Leave the language of commands called in this process as it was."""
    yield
    if (terminal := sys.modules.get("grader.cli.terminal")) is not None:
        terminal.speak("en")


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of material kept beside the project; tests that need it are skipped without."""
    folder = Path(__file__).resolve().parent.parent.parent / "shared"
    if not folder.is_dir():
        pytest.skip("the folder ../shared is not beside the project")
    return folder
