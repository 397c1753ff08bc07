"""From accounts of a drawing to the mistakes that are told: how sure, what they explain, what rivals them."""

import math
from collections.abc import Sequence
from dataclasses import replace

from grader.diagnosis.case import Case
from grader.outcomes import NamedMistake
from reference.construction import Construction
from reference.elements import Along, Line
from reference.mistakes import RPM_FACTOR, Mistake, affected
from reference.replay import Account
from reference.steps import Step, TwoLines

SURE_TOGETHER = 0.8
"""A mistake and its rivals are told together when one of them it is, this surely."""
LEAST_RIVAL = 0.1
"""A rival less likely than this is not named."""
MOST_RIVALS = 3
SUSPICIOUS, GROSS = 2.0, 5.0
"""Standard deviations of this hand: what is off by less than the latter at a step is no mistake to be
named. (Where it is not off at all, the mistake showed elsewhere.)"""
OF_THE_WHOLE = frozenset({"labels_swapped", "figure_rotated", "other_variant"})
RPM_WITHIN = 0.03
"""Relative: a scale off by 30/pi (squared for accelerations) this nearly was made from rev/min."""
SCALES = frozenset({"kL", "kv", "ka"})

Key = tuple[str, str]


def told(accounts: Sequence[Account], case: Case, least: float) -> tuple[NamedMistake, ...]:
    """The mistakes of the likeliest account that are sure enough, in the order of construction."""
    if not accounts:
        return ()
    best = accounts[0]
    shares = _Shares(accounts)
    explained = _explained(best, case)
    found = []
    for mistake in _in_order(best.made, case.drawing.construction):
        share = shares.of(_key(mistake))
        rivals = shares.rivals(_key(mistake), {_key(one) for one in best.made})
        together = share + sum(shares.instead(_key(mistake), _key(one)) for one in rivals)
        if _is_slight(mistake, best):
            continue
        if share < least and (together < SURE_TOGETHER or not rivals):
            continue
        others = tuple(_record(one, case, (), shares.instead(_key(mistake), _key(one))) for one in rivals)
        if explained[mistake]:
            found.append(_record(mistake, case, tuple(explained[mistake]), share, others))
    return tuple(found)


def _key(mistake: Mistake) -> Key:
    return mistake.code, mistake.at


def _is_slight(mistake: Mistake, account: Account) -> bool:
    """Whether the step that it was made at is not far off: nothing that a hand could not do."""
    if mistake.code in OF_THE_WHOLE:
        return False
    return SUSPICIOUS < account.right.get(mistake.at, 0.0) < GROSS


class _Shares:
    """What share of the probability accounts with a mistake have."""

    def __init__(self, accounts: Sequence[Account]) -> None:
        least = accounts[0].cost
        weights = [math.exp((least - account.cost) / 2.0) for account in accounts]
        whole = sum(weights)
        self._accounts = [
            ({_key(one): one for one in account.made}, weight / whole)
            for account, weight in zip(accounts, weights, strict=True)
        ]

    def of(self, key: Key) -> float:
        """Of a mistake."""
        return sum(weight for made, weight in self._accounts if key in made)

    def instead(self, key: Key, other: Key) -> float:
        """Of another mistake without the first."""
        return sum(weight for made, weight in self._accounts if other in made and key not in made)

    def rivals(self, key: Key, best: set[Key]) -> list[Mistake]:
        """The mistakes that stand in a mistake's place elsewhere, the likeliest first."""
        others = {name: one for made, _ in self._accounts if key not in made for name, one in made.items()}
        likely = [name for name in others if name not in best and self.instead(key, name) >= LEAST_RIVAL]
        likely.sort(key=lambda name: -self.instead(key, name))
        return [others[name] for name in likely[:MOST_RIVALS]]


def _in_order(made: Sequence[Mistake], construction: Construction) -> list[Mistake]:
    """Mistakes of the whole first, then step by step."""
    order = [step.node for step in construction.steps]
    return sorted(made, key=lambda one: order.index(one.at) if one.at in order else -1)


def _explained(account: Account, case: Case) -> dict[Mistake, list[str]]:
    """Which of the criteria lost each mistake explains: the nearest one before it in the construction."""
    construction = case.drawing.construction
    made = _in_order(account.made, construction)
    explains: dict[Mistake, list[str]] = {
        mistake: [name for scale, name in case.scale_criteria.items() if _is_about(mistake, scale)]
        for mistake in made
    }
    reach = {mistake: affected(mistake, construction) for mistake in made}
    for name, criterion in case.lost.items():
        vector = construction.vectors[name]
        if vector.head in account.unexplained:
            continue
        touching = [
            one for one in made if _touches(one, vector.scale, {vector.tail, vector.head}, reach[one])
        ]
        own = [one for one in touching if one.at == vector.head]
        for mistake in (own or touching)[-1:]:
            explains[mistake].append(criterion)
    return explains


def _touches(mistake: Mistake, scale: str, ends: set[str], reach: frozenset[str]) -> bool:
    if mistake.at in SCALES:
        return mistake.at in {scale, "kL"}
    if mistake.code == "labels_swapped":
        return bool(ends & set(mistake.other))
    return bool(ends & reach)


def _is_about(mistake: Mistake, scale: str) -> bool:
    return mistake.at == scale or mistake.code == "other_variant"


# The record ---------------------------------------------------------------------------------------


def _record(
    mistake: Mistake,
    case: Case,
    explains: tuple[str, ...],
    confidence: float,
    rivals: tuple[NamedMistake, ...] = (),
) -> NamedMistake:
    if mistake.code == "scale_wrong":
        mistake = replace(mistake, code=_code_of_scale(mistake.at, mistake.factor))
    is_line = mistake.code in LINE_MISTAKES
    line = _line_of(case.drawing.construction.step(mistake.at), mistake.slot) if is_line else {}
    return NamedMistake(mistake, explains, min(confidence, 1.0), line, rivals)


LINE_MISTAKES = frozenset({"parallel_for_perpendicular", "wrong_link", "wrong_intersection"})


def _line_of(step: Step, slot: int) -> dict[str, str]:
    """Which line of a step it is: where it starts, the link that gives its direction, if a guide does."""
    line = (step.first, step.second)[slot] if isinstance(step, TwoLines) else None
    if not isinstance(line, Line):
        return {}
    told = {"from": line.through}
    if line.along.quarters % 2 == 0:
        # Perpendiculars are of turning links, all else is along what something slides on.
        told["line"] = "guide"
    if isinstance(line.along, Along):
        told["link"] = line.along.tail + line.along.head
    return told


def _code_of_scale(name: str, factor: float) -> str:
    powers = {"kv": 1, "ka": 2}
    rpm = RPM_FACTOR ** powers.get(name, 0)
    return "rpm_not_converted" if name in powers and abs(factor / rpm - 1.0) <= RPM_WITHIN else "scale_wrong"
