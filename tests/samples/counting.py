"""Readings held against the truth of what was drawn: reads for the floor, misreads for the ceiling."""

from grader.cli.benchmark import RIGHT_MM, SURE, WRONG_MM, vector_results

LEAST_MM = 5.0


def counted(truths, readings):
    """Vectors of 5 mm or more read right, and those of any length reported with confidence but wrong."""
    both = zip(truths, readings, strict=True)
    results = [result for truth, reading in both for result in vector_results(truth, reading)]
    right = sum(result.error_mm <= RIGHT_MM and result.length_mm >= LEAST_MM for result in results)
    believed = [result for result in results if result.confidence >= SURE]
    return right, [result for result in believed if result.error_mm > WRONG_MM]
