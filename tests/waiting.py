"""Waiting for what goes on in another thread or process."""

import time

PATIENCE_S = 600.0
"""A machine that is busy with other work takes long, and fails no test."""


def until(told):
    """What `told()` gives as soon as that is something. Raises AssertionError where it never is."""
    end = time.monotonic() + PATIENCE_S
    while not (answer := told()):
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.05)
    return answer
