"""A data base of an earlier version goes on: columns are added, what launches gave is taken over."""

import sqlite3
from pathlib import Path

import pytest

from grader.web.store import Link, LtiClaim, LtiUser, Member, Publication, Sheet, Store

FIRST = Path(__file__).with_name("older_store.sql")
ROWS = """
INSERT INTO publications VALUES (1, 'publication1', '', '', 'pump', 'en', 'hint', NULL, 1, 1, 1, NULL, 1.0);
INSERT INTO accounts VALUES (1, 'Ana', 'hash', 1, 1.0), (2, 'Radu', '', 0, 1.0), (3, 'Mara', '', 0, 1.0);
INSERT INTO lti_platforms VALUES (1, 'https://a.example', 'c', 'x', 'x', 'x', '[]');
INSERT INTO lti_users VALUES
  (1, 1, 'user-1', 2, '{}'), (2, 1, 'user-2', NULL, '{"1": "s09", "7": "s01"}'),
  (3, 1, 'user-3', NULL, '{"1": "s09"}'), (4, 1, 'user-4', NULL, '{"1": "s11"}'), (5, 1, 'user-5', 3, '{}');
INSERT INTO members VALUES (1, 1), (1, 2), (1, 3);
INSERT INTO links VALUES (1, 1, 's09', 1e12, 0, 1.0), (2, 1, 's11', 1e12, 0, 1.0);
INSERT INTO audit VALUES
  (1, 1.0, 'Radu', 'member added', 'publication1 Radu'), (2, 1.0, 'Ana', 'member added', 'publication1 Mara');
"""
"""Radu became a member by a launch, Mara by a colleague; two came as s09; one class was deleted."""


@pytest.fixture
def older(tmp_path):
    with sqlite3.connect(tmp_path / "older.sqlite") as plain:
        plain.executescript(FIRST.read_text(encoding="utf-8") + ROWS)
    plain.close()
    return f"sqlite:///{tmp_path / 'older.sqlite'}"


def test_what_an_earlier_version_kept_goes_on(older):
    for attempt in range(2):  # what was taken over is not taken over again
        store = Store(older)
        with store.session() as session:
            subjects = {one.id: one.subject for one in session.query(LtiUser)}
            claims = {(one.student_id, subjects[one.user_id]): one.holds for one in session.query(LtiClaim)}
            links = {one.student_id: one.is_revoked for one in session.query(Link)}
            members = {one.account_id: one.platform_id for one in session.query(Member)}
            session.add(LtiUser(platform_id=1, subject=f"new-{attempt}"))
            assert session.query(Sheet).count() == 0
            (one,) = session.query(Publication)
            assert (one.is_over, one.shows_feedback) == (False, True)
        store.close()
        assert claims == {("s09", "user-2"): False, ("s09", "user-3"): False, ("s11", "user-4"): True}
        assert links == {"s09": True, "s11": False}
        assert members == {1: None, 2: 1, 3: None}
