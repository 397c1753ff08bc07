"""Wait for events in another thread or process."""

import time

PATIENCE_S = 600.0
"""A machine that is busy with other work takes long, and fails no test."""


def until(told):
    """Wait until `told()` returns something true, and return it. Raises AssertionError if it never does."""
    end = time.monotonic() + PATIENCE_S
    while not (answer := told()):
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.01)
    return answer
