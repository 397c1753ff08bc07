"""Tables for people and for learning management systems, validated before anything is written."""

from grader.lms.deliver import Delivery, export, read_results, usual_name
from grader.lms.grades import Person
from grader.lms.options import TARGETS, Options
from grader.lms.platform_ids import with_ids
from grader.lms.summary import write_summary

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
