"""Rubrics and students' points as requests to a platform's API: bodies as files, and a plan of the calls.

Each body is what a schema of `grader/lms/schemas` says, written from the platform's documentation, which the
plan names. A rubric that is there already (`--criteria`, the platform's answer) is not made again. Only
`grader.lms.send` sends, over a `Connection`.
"""
