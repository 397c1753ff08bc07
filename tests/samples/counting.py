"""Readings held against the truth of what was drawn: reads for the floor, misreads for the ceiling."""

import numpy as np

RIGHT_MM, WRONG_MM, LEAST_MM, SURE = 0.5, 1.0, 5.0, 0.9


def counted(truths, readings):
    """Vectors of 5 mm or more read right, and those of any length reported with confidence but wrong."""
    right, misread = 0, []
    for truth, reading in zip(truths, readings, strict=True):
        for figure, drawn in truth["figures"].items():
            found = reading.figures.get(figure)
            for vector in drawn.get("vectors", {}) if found else ():
                error, confidence = miss_mm(drawn, vector, found.vectors.get(vector))
                right += error <= RIGHT_MM and drawn["vectors"][vector]["length_mm"] >= LEAST_MM
                if error > WRONG_MM and confidence >= SURE:
                    misread.append((vector, round(error, 2), round(confidence, 3)))
    return right, misread


def miss_mm(drawn, name, as_read):
    """How far a vector as read is from the one drawn: node to node, or along its stroke."""
    if as_read is None or as_read.length_mm is None:
        return np.inf, 0.0
    vector = drawn["vectors"][name]
    ends = [drawn["nodes"][vector["tail"]], drawn["nodes"][vector["head"]]]
    ways = [complex(q[0] - p[0], p[1] - q[1]) for p, q in (ends, vector["line_mm"] or ends)]
    read_as = as_read.length_mm * np.exp(1j * np.radians(as_read.direction_deg or 0.0))
    return min(abs(read_as - way) for way in ways), as_read.confidence
