"""All variants of an assignment for the instructor's own records: a table, and pages to print."""
