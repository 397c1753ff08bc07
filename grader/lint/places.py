"""Where in the files something stands."""

from grader.lint.findings import File
from reference.assignment import Assignment


def mechanism_place(assignment: Assignment, key: str = "") -> tuple[File, str]:
    """The file and path of a key of the mechanism, which may stand within the assignment's file."""
    if isinstance(assignment.file.mechanism, str):
        return "mechanism", f"${key}"
    return "assignment", f"$.mechanism{key}"


def group_place(assignment: Assignment, joint: str | None) -> tuple[File, str]:
    """The file and path of the group that adds a joint; the driven link's, or the whole mechanism's."""
    tables = assignment.mechanism_file.group
    for index, table in enumerate(tables):
        if joint is not None and joint == getattr(table, "node", None):
            return mechanism_place(assignment, f".group[{index}]")
    return mechanism_place(assignment)


def group_of_image(assignment: Assignment, node: str) -> tuple[File, str]:
    """The place of the group whose joint has this image in a plan: ``b'`` is made by the group of B."""
    joint = node.removesuffix("'")
    known = {table.node.lower(): table.node for table in assignment.mechanism_file.group}
    return group_place(assignment, known.get(joint))
