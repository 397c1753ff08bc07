"""A cycle as a table for spreadsheets and programs: a row for each sample, all digits, units in the head."""

import csv
import io

import numpy as np

from grader.cycle.quantities import Asked, Subject
from reference.geometry import FloatArray


def cycle_csv(subject: Subject, asked: Asked, *, decimal_comma: bool = False) -> str:
    """The driven coordinate, what is asked for, and why where nothing is told.

    Numbers with all their digits (they read back as the same doubles), blank where there is none; the
    file begins as ``crank angle [deg],v_B [m/s],x_D [m]`` and ends with the column ``note``. With decimal
    commas fields are separated by semicolons. UTF-8 without a mark, CRLF.
    """
    cycle = subject.cycle
    first = (
        ("crank angle [deg]", np.degrees(cycle.driven))
        if cycle.is_turned
        else ("displacement [m]", cycle.driven)
    )
    columns: list[tuple[str, FloatArray]] = [first]
    for quantity in asked.quantities:
        unit = quantity.unit.replace("s²", "s^2")
        columns.append((f"{quantity.name} [{unit}]", subject.values(quantity)))
    for point in asked.points:
        place = np.broadcast_to(cycle.motion.position[point], cycle.driven.shape)
        columns += [(f"x_{point} [m]", place.real), (f"y_{point} [m]", place.imag)]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\r\n", delimiter=";" if decimal_comma else ",")
    writer.writerow([*(heading for heading, _ in columns), "note"])
    for row in range(cycle.driven.size):
        numbers = [_written(float(values[row]), decimal_comma) for _, values in columns]
        writer.writerow([*numbers, cycle.untold.get(row, "")])
    return buffer.getvalue()


def _written(value: float, decimal_comma: bool) -> str:
    if not np.isfinite(value):
        return ""
    # Adding zero turns minus zero into zero.
    text = repr(value + 0.0)
    return text.replace(".", ",") if decimal_comma else text
