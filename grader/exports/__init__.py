"""Tables for people and for learning management systems, validated before anything is written."""

from grader.exports.deliver import Delivery, export, read_results, usual_name
from grader.exports.grades import Person
from grader.exports.options import TARGETS, Options
from grader.exports.platform_ids import with_ids
from grader.exports.summary import write_summary

__all__ = [
    "TARGETS",
    "Delivery",
    "Options",
    "Person",
    "export",
    "read_results",
    "usual_name",
    "with_ids",
    "write_summary",
]
