"""Tables for people and for learning management systems, validated before anything is written."""

from grader.exports.deliver import TARGETS, Delivery, Target, export, read_results
from grader.exports.grades import Person
from grader.exports.summary import write_summary

__all__ = ["TARGETS", "Delivery", "Person", "Target", "export", "read_results", "write_summary"]
