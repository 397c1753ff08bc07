"""What all tests share."""

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings

settings.register_profile("dev", max_examples=25, deadline=None)
settings.register_profile(
    "ci",
    max_examples=25,  # the same in every run: more would only hold again what held; "dev" draws new ones
    deadline=None,
    derandomize=True,
    phases=[Phase.explicit, Phase.generate],  # a failure is told at once, and shrunk by whoever mends it
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci" if os.environ.get("CI") else "dev"))

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it starts in the background ignore Ctrl+C, and the programs that tests start with it.
    signal.signal(signal.SIGINT, signal.default_int_handler)

SLOW = (
    "bench", "browser", "docs/test_readme", "functional", "fuzz", "laws", "samples", "synthetic",
    "unit/bench", "unit/folder/test_workers", "unit/older", "unit/reading",
    "unit/reference/test_exact_plan", "unit/review/test_session", "unit/scan/decode/test_hostile",
    "unit/scan/handwriting", "unit/scan/register", "unit/scan/strokes", "unit/similarity",
)  # fmt: skip
"""Where tests run the whole program, read scans, or try many cases; the others are the quick set."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark slow tests by where they stand; `-m "not slow"` runs the quick set in under a minute."""
    tests = Path(__file__).parent
    for item in items:
        if item.path.relative_to(tests).as_posix().startswith(SLOW):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of material kept beside the project; tests that need it are skipped without."""
    folder = Path(__file__).resolve().parent.parent.parent / "shared"
    if not folder.is_dir():
        pytest.skip("the folder ../shared is not beside the project")
    return folder
