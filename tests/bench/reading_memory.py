"""Peak memory of reading a student's sheets, in a process of its own.

    python -m tests.bench.reading_memory ASSIGNMENT N POSITION FILE...

prints megabytes; N and POSITION are `-` if the assignment has none.
"""

import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from grader.pipeline import read_pages
from grader.records import PageRef
from grader.rubric import load_rubric
from grader.scan.page import open_page
from reference.authored.assignment import Variant, load_assignment


def peak_mb(assignment: str, variant: Variant, paths: Sequence[Path]) -> float | None:
    """Peak memory of a process that reads these sheets; None where it fails."""
    who = ["-" if number is None else str(number) for number in (variant.n, variant.position)]
    command = [sys.executable, "-m", "tests.bench.reading_memory", assignment, *who, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - itself
    return float(done.stdout) if done.returncode == 0 and done.stdout else None


def _own_peak_mb() -> float:
    """This process's peak since its program began; `ru_maxrss` would include its parent's."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return float(line.split()[1]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main(name: str, n: str, position: str, *files: str) -> None:
    """Read the sheets and print the peak."""
    assignment = load_assignment(name)
    variant = Variant(*(None if told == "-" else int(told) for told in (n, position)))
    wanted = load_rubric(assignment.file.rubric, beside=assignment.path).vectors
    read_pages([open_page(PageRef(file, path=Path(file))) for file in files], assignment, variant, {}, wanted)
    sys.stdout.write(f"{_own_peak_mb():.1f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
