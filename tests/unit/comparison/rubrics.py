"""Tasks with something of their rubric changed, and what is looked up in a comparison."""

from dataclasses import replace

from grader.rubric import HandTable


def with_rubric(task, **change):
    """The same task under a changed rubric."""
    return replace(task, rubric=task.rubric.model_copy(update=change))


def with_criterion(task, name, **change):
    """The same task with one criterion changed."""
    criteria = [one.model_copy(update=change) if one.id == name else one for one in task.rubric.criterion]
    return with_rubric(task, criterion=criteria)


def without_hand(task):
    """The same rubric with its tolerances as they stand, widened for nobody's hand."""
    return with_rubric(task, hand=HandTable(sigmas=0.0))


def outcome_of(comparison, criterion):
    return next(one for one in comparison.outcomes if one.criterion == criterion)


def codes(outcome):
    return [reason.code for reason in outcome.reasons]
