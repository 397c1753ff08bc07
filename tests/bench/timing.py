"""Processor time of many things side by side, in turns, so that a busy minute falls on all alike."""

import statistics
import time
from collections.abc import Callable, Hashable, Mapping
from typing import TypeVar

LEAST_RUN_S = 0.02
"""A run is repeated inside until it takes so long, so that the clock's own steps do not count."""
SLOW_S = 0.2
"""A run that takes longer is timed in the first few rounds only."""
FEW_ROUNDS = 5

Key = TypeVar("Key", bound=Hashable)


def medians_us(runs: Mapping[Key, Callable[[], object]], rounds: int) -> dict[Key, float]:
    """Median microseconds of each run over so many rounds; a round takes each run once.

    The clock is the thread's own processor time: other work on the machine does not count.
    """
    once = {key: _once(run) for key, run in runs.items()}
    spent: dict[Key, list[float]] = {key: [] for key in runs}
    for number in range(rounds):
        for key, run in runs.items():
            if once[key] < SLOW_S or number < FEW_ROUNDS:
                spent[key].append(_mean(run, max(1, int(LEAST_RUN_S / once[key]))))
    return {key: statistics.median(times) * 1e6 for key, times in spent.items()}


def _once(run: Callable[[], object]) -> float:
    """The first run warms up, the second is timed."""
    run()
    return max(_mean(run, 1), 1e-9)


def _mean(run: Callable[[], object], loops: int) -> float:
    start = time.thread_time()
    for _ in range(loops):
        run()
    return (time.thread_time() - start) / loops
