"""Tables of the recogniser's figures."""

import sys
from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from grader.scan.handwriting.model import COLUMN, JUNK, Model, features

_PLAN = "oabcdpABCDπ"
_LEVELS = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)


Pictures = tuple[np.ndarray, np.ndarray, np.ndarray]
_HEAD = (
    "| written by | signs | right | o a b c d p π A B C D | digits | junk known |",
    "|---|---|---|---|---|---|",
)


def print_tables(model: Model, tests: Mapping[str, Mapping[str, Pictures]], trained_on: str) -> None:
    """Measure a model on test pictures by trouble and font; print the tables."""
    text = f"Trained on {trained_on}; the fonts and digits below were left out.\n"
    for how, test in tests.items():
        rows, sure, hit = list(_HEAD), [], []
        for name, (pictures, sizes, labels) in test.items():
            probability = model.probability(features(pictures, sizes))
            rows.append(_row(name, probability.argmax(axis=1), labels))
            sure.append(probability.max(axis=1))
            hit.append(probability.argmax(axis=1) == labels)
        rows.append(f"| all | {sum(map(len, hit))} | {np.concatenate(hit).mean():.3f} | | | |")
        table = _calibration(np.concatenate(sure), np.concatenate(hit))
        text += f"\n{how.capitalize()}:\n\n" + "\n".join(rows) + f"\n\n{table}"
    sys.stdout.write(text)


def _row(name: str, named: np.ndarray, labels: np.ndarray) -> str:
    junk = COLUMN[JUNK]
    sign = labels != junk
    plan, digit = (np.isin(labels, [COLUMN[s] for s in group]) for group in (_PLAN, "o123456789"))

    def share(rows: np.ndarray, right: np.ndarray) -> str:
        return f"{right[rows].mean():.3f}" if rows.any() else "-"

    right = named == labels
    shares = [share(rows, right) for rows in (sign, plan & sign, digit, ~sign)]
    return f"| {name} | {sign.sum()} | {' | '.join(shares)} |"


def _calibration(sure: np.ndarray, hit: np.ndarray) -> str:
    rows = ["| said certainty | signs | mean said | right |", "|---|---|---|---|"]
    for low, high in pairwise(_LEVELS):
        here = (sure >= low) & (sure < high if high < 1.0 else sure <= 1.0)
        if here.any():
            told, right = sure[here].mean(), hit[here].mean()
            rows.append(f"| {low:.2f} - {high:.2f} | {here.sum()} | {told:.3f} | {right:.3f} |")
    return "\n".join(rows) + "\n"
