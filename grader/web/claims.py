"""Claims of platform users to be students of a roster: the first one holds until the instructor decides.

A student is found by the platform's id of the person, or by e-mail; the platform lets people change both.
Whoever comes as a student whom somebody else is already, or as a second one, is refused and listed.
"""

import threading
from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter
from sqlalchemy import select, update

from grader.tables.roster import RosterRow
from grader.texts.spoken import RefusedError
from grader.web.launch import Message
from grader.web.service import Call, Called, Own, Route, Row
from grader.web.store import Link, LtiClaim, LtiUser, Publication, columns_of

router = APIRouter(route_class=Route, prefix="/api/v1/publications/{key}/lti/claims", tags=["lti"])
_CLAIMING = threading.Lock()
"""Held while a claim is made: of two people who come as the same student at once, one is first."""


def row_of(call: Call, publication: Publication, message: Message) -> RosterRow | None:
    """Return the student's line of the roster: by the platform's id of the person, or by e-mail."""
    rows = call.places(publication).students()
    ids = {one for one in (message.person and message.person.person_sourcedid, message.sub) if one}
    email = (message.email or "").casefold()
    named = [row for row in rows if row.student_id in ids]
    mailed = [row for row in rows if email and (row.email or "").casefold() == email]
    found = {row.student_id: row for row in (named or mailed)}
    return next(iter(found.values())) if len(found) == 1 else None


def claimed(call: Call, user: LtiUser, publication: Publication, student: str, message: Message) -> LtiClaim:
    """Return the claim of somebody to be the student. Raises RefusedError where another came first."""
    of_publication = LtiClaim.publication_id == publication.id
    with _CLAIMING:
        others = call.session.scalars(select(LtiClaim).where(of_publication)).all()
        own = [one for one in others if (one.user_id, one.student_id) == (user.id, student)]
        claim = own[0] if own else None
        if claim is None:
            is_first = not any(
                one.student_id == student or (one.user_id == user.id and one.holds) for one in others
            )
            who = " ".join(filter(None, (message.name, message.email))) or message.sub
            claim = LtiClaim(
                publication_id=publication.id,
                user_id=user.id,
                student_id=student,
                who=who[:200],
                holds=is_first,
            )
            call.session.add(claim)
            call.note("came as a student" if is_first else "claim waits", f"{publication.key} {student}")
        call.session.commit()
    if not claim.holds:
        raise RefusedError(409, "lti_claimed")
    return claim


# What the instructor decides ------------------------------------------------------------------------


@router.get("")
def listed(call: Called, own: Own) -> list[dict[str, Any]]:
    """List who came from platforms as which student, first those whom several people claim to be."""
    found = call.session.scalars(select(LtiClaim).where(LtiClaim.publication_id == own.id)).all()
    waiting = {one.student_id for one in found if not one.holds}
    rows = [columns_of(one, "id", "student_id", "who", "holds", "created") for one in found]
    return sorted(rows, key=lambda row: (row["student_id"] not in waiting, row["student_id"], row["id"]))


@router.put("/{number}")
def decide(call: Called, own: Own, number: Row) -> dict[str, str]:
    """Decide that this person is the student; nobody else is any more."""
    claim = call.row_of(own, LtiClaim, number, "claim")
    others = call.session.scalars(
        select(LtiClaim).where(
            LtiClaim.publication_id == claim.publication_id, LtiClaim.id != claim.id, LtiClaim.holds,
            (LtiClaim.student_id == claim.student_id) | (LtiClaim.user_id == claim.user_id),
        )
    ).all()  # fmt: skip
    for other in others:
        other.holds = False
    take_back_links(call, [one.id for one in others])
    claim.holds = True
    call.note("claim decided", f"{own.key} {claim.student_id}")
    return {"state": "decided"}


@router.delete("/{number}")
def refuse(call: Called, own: Own, number: Row) -> dict[str, str]:
    """Decide that this person is not the student, and revoke the links that the launch gave."""
    claim = call.row_of(own, LtiClaim, number, "claim")
    take_back_links(call, [claim.id])
    call.session.delete(claim)
    call.note("claim refused", f"{own.key} {claim.student_id}")
    return {"state": "refused"}


def take_back_links(call: Call, numbers: Sequence[int]) -> None:
    """Revoke the links that launches gave by some claims."""
    call.session.execute(update(Link).where(Link.claim_id.in_(numbers)).values(is_revoked=True))
