"""``python -m grader``: the same as ``planmark``."""

from grader.cli import main

main()
