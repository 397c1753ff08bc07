"""Vector equations with what is known of each term, and formulas of sizes, scales and speeds."""

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from grader.language import N_
from grader.solution.forces import balance_of, force_formula, moment_formula
from grader.solution.formulas import TICK, Formula, Fraction, Grid, Name
from grader.solution.sentences import Speaker, guided
from reference.authored.assignment import SCALE_NAMES
from reference.authored.formula import Formula as AuthoredFormula
from reference.authored.formula import Value
from reference.construction.elements import (
    Along,
    Balance,
    Coriolis,
    Fixed,
    Inertia,
    Length,
    Normal,
    Same,
    Scaled,
    side_at,
)
from reference.construction.equations import Equation, Proportion, Term
from reference.drawing.canvas import Piece, pieces_of
from reference.mechanism import Crank
from reference.quantities import OF_MOTION, kind_of, unit_of

SIZE, DIRECTION, PAPER = N_("size"), N_("direction"), N_("on paper")
GUIDE, SLOT = N_("guide of %(joint)s"), N_("slot of %(joint)s")
DRAWN = N_("drawn")
KNOWN, UNKNOWN = TICK, "?"

# Equations ----------------------------------------------------------------------------------------


def grid_of(speaker: Speaker, equation: Equation, *, with_numbers: bool) -> Grid:
    """Return an equation with rows for size and direction; with numbers also real and drawn sizes."""
    terms = equation.terms
    signs = [
        "−" if term.is_negative else "+" if at else "="
        for terms in equation.sums
        for at, term in enumerate(terms)
    ]
    is_zero = equation.left is None
    signs = [*signs[1:], "="] if is_zero else signs

    def row(head: str, cells: list[Formula], between: list[str], zero: str = "") -> tuple[Formula, ...]:
        rest = zip(between, [*cells[1:], *([zero] if is_zero else [])], strict=True)
        return (head, cells[0], *(part for pair in rest for part in pair))

    blank = [""] * len(signs)
    _ = speaker.tongue.gettext
    rows = [
        row("", [replace(speaker.symbol(term.vector), is_vector=True) for term in terms], signs, "0"),
        row(_(SIZE), [_size(speaker, term) for term in terms], blank),
    ]
    if with_numbers:
        scale = kind_of(terms[0].vector).scale
        drawn = [_drawn_mm(speaker, term) if term.is_drawn or term.size else None for term in terms]
        real = ["" if mm is None else speaker.bare(mm * speaker.scale_value(scale)) for mm in drawn]
        paper = ["" if mm is None else speaker.tongue.number(mm, 2) for mm in drawn]
        rows += [row(speaker.tongue.unit(kind_of(scale).unit), [*real], blank)]
        rows += [row(f"{_(PAPER)}, {speaker.tongue.unit('mm')}", [*paper], blank)]
    rows.append(row(_(DIRECTION), [_direction(speaker, term) for term in terms], blank))
    lines = (0, terms[0].known, *(part for term in terms[1:] for part in (0, term.known)))
    return Grid(tuple(rows), (*lines, 0, 0) if is_zero else lines)


def _size(speaker: Speaker, term: Term) -> Formula:
    match term.size:
        case None:
            return KNOWN if term.is_drawn else UNKNOWN
        case Proportion(base=base, model=(q, p, x)):
            return Fraction((speaker.symbol(*base[::-1]), " · ", speaker.symbol(p, x)), speaker.symbol(q, p))
    formula = None if isinstance(term.size, Balance) else size_formula(speaker, term.size, term.head)
    return KNOWN if formula is None else formula[0]


def _direction(speaker: Speaker, term: Term) -> Formula:
    match term.along:
        case Along(tail=tail, head=head, quarters=quarters, side=side):
            if quarters % 2:
                return ("⊥ ", speaker.symbol(tail, head))
            if term.size is None:
                return ("∥ ", speaker.symbol(tail, head))
            back = isinstance(term.size, Balance) and float(term.size.at(speaker.view)) < 0.0
            turned = ((quarters % 4 == 2) != (side_at(side, speaker.view) < 0)) != back
            first, second = (head, tail) if turned else (tail, head)
            return (speaker.symbol(first), " → ", speaker.symbol(second))
        case None:
            if isinstance(term.size, Proportion):
                return _turned(speaker, term.size, term.head)
            return KNOWN if term.is_drawn else UNKNOWN
        case Fixed() as along if guided(along)[0] in {"slot", "guide"}:
            kind, joint = guided(along)
            text = SLOT if kind == "slot" else GUIDE
            before, after = speaker.tongue.gettext(text).split("%(joint)s")
            return ("⊥ " if along.quarters % 2 else "∥ ", before, speaker.symbol(joint), after)
        case _:
            return KNOWN


def _turned(speaker: Speaker, similar: Proportion, end: str) -> Formula:
    """Describe the direction of a link's vector by that of another: in line, or at the link's angle."""
    (p, q), (other, pin, joint) = similar.base, similar.model
    if speaker.is_flat(pin, other, joint):
        return ("∥ ", speaker.symbol(q, p))
    return ("∠ ", speaker.symbol(q, p, end), " = ∠ ", speaker.symbol(*similar.model))


def _drawn_mm(speaker: Speaker, term: Term) -> float:
    mm = speaker.distance(term.tail, term.head)
    return 0.0 if speaker.is_nothing(term.head, mm) else mm


# Sizes --------------------------------------------------------------------------------------------


def size_formula(speaker: Speaker, length: Length, node: str) -> tuple[Formula, Formula] | None:
    """Return how a vector's size is computed, in names and in numbers; None for a given datum.

    `node` is the vector's end in its plan.
    """
    match length:
        case Normal(tail=tail, head=head):
            speed, arm = speaker.vector(tail, head), _arm(speaker, length)
            return (
                Fraction((speaker.symbol(speed), "²"), speaker.link_of(node)),
                Fraction((_speed(speaker, tail, head), "²"), speaker.bare(arm)),
            )
        case Coriolis(slide=slide):
            carrier = speaker.carrier_of(node)
            turn = abs(speaker.subject.number(np.asarray(speaker.subject.plan.motion.omega[carrier])))
            names = (speaker.symbol(f"omega_{carrier}"), " · ", speaker.symbol(speaker.vector(*slide)))
            numbers = (speaker.bare(turn), " · ", _speed(speaker, *slide))
            return ("2 · ", names), ("2 · ", numbers)
        case Balance():
            total = balance_of(speaker, node)
            return None if total is None else moment_formula(speaker, total)
        case Inertia() | Same() | Scaled(scale="kF"):
            return force_formula(speaker, length)
    driver = speaker.subject.plan.mechanism.driver
    quantity = getattr(length, "quantity", "")
    if not isinstance(driver, Crank) or kind_of(quantity).scale not in OF_MOTION:
        return None
    turns = quantity == f"a_{driver.pin}_t"
    rate, name = (driver.epsilon, "epsilon") if turns else (driver.omega, "omega")
    power = ("²",) if quantity == f"a_{driver.pin}_n" else ()
    values = (speaker.bare(abs(speaker.subject.number(np.asarray(one)))) for one in (rate, driver.length_m))
    arm_name = speaker.symbol(driver.pivot, driver.pin)
    return (
        (speaker.symbol(f"{name}_{driver.link}"), *power, " · ", arm_name),
        (next(values), *power, " · ", next(values)),
    )


def _speed(speaker: Speaker, tail: str, head: str) -> str:
    """Write the value of a velocity of the plan."""
    return speaker.bare(speaker.distance(tail, head) * speaker.scale_value("kv"))


def _arm(speaker: Speaker, length: Normal) -> float:
    if length.measured is not None:
        return float(speaker.view.real_length(*length.measured))
    return float(speaker.view.parameters[length.length])


# The crank's speed and the scales -----------------------------------------------------------------


def driving_speed(speaker: Speaker) -> Iterator[Formula]:
    """Yield omega of the crank by the assignment's own formula: from rev/min, through a gear."""
    subject = speaker.subject
    driver, file = subject.plan.mechanism.driver, subject.assignment.mechanism_file
    crank = getattr(file, "crank", None)
    if crank is None or not isinstance(driver, Crank):
        return
    name = f"omega_{driver.link}"
    value = speaker.real(abs(subject.number(np.asarray(driver.omega))), unit_of(name))
    known = subject.assignment.values([subject.plan.variants[subject.index]])
    if crank.rpm is None:
        rule = crank.omega  # none where a cylinder turns the crank
        is_computed = rule is not None and (rule.names or "/" in rule.text)
        yield (speaker.symbol(name), *(_both(speaker, rule, known) if is_computed else ()), " = ", value)
        return
    ratio = crank.gear_ratio
    turns = [(crank.rpm, "n"), *([(ratio, "U")] if ratio is not None else [])]
    letters = [_given(speaker, formula.text, letter) for formula, letter in turns]
    numbers = [speaker.bare(abs(float(np.ravel(formula(known))[0]))) for formula, _ in turns]
    chain = (_over_30(*parts) for parts in (letters, numbers))
    yield (speaker.symbol(name), " = ", next(chain), " = ", next(chain), " = ", value)


def _over_30(turns: Formula, ratio: Formula = "") -> Formula:
    return Fraction(("π · ", turns), ("30 · ", ratio) if ratio else "30")


def scale_formula(speaker: Speaker, scale: str) -> Formula:
    """Return how a scale follows: real over drawn size, then the assignment's own rule with its numbers."""
    subject, plan = speaker.subject, speaker.subject.plan
    assignment, variants = subject.assignment, [subject.plan.variants[subject.index]]
    rule: AuthoredFormula = getattr(assignment.file.scales, scale)
    value = speaker.scale_value(scale)
    driver = plan.mechanism.driver
    known = assignment.scale_values(variants, kL=speaker.scale_value("kL"))
    name, end = speaker.scale(scale), (" = ", speaker.real(value, unit_of(scale)))
    if not rule.names or not np.isclose(float(np.ravel(rule(known))[0]), value):
        return (name, *end)
    first: tuple[Formula, ...] = ()
    if scale in OF_MOTION and rule.names & {"omega", "speed", "crank_m"}:
        vector = plan.construction.vectors[f"{kind_of(scale).letter}_{driver.pin}"]
        first = (" = ", Fraction(speaker.symbol(vector.name), speaker.symbol(vector.tail, vector.head)))
    return (name, *first, *_both(speaker, rule, known), *end)


def _both(speaker: Speaker, rule: AuthoredFormula, known: Mapping[str, Value]) -> tuple[Formula, ...]:
    """Write an authored formula in names, then in numbers."""

    def number(name: str) -> Formula:
        return speaker.bare(float(np.ravel(known[name])[0]))

    names, numbers = _written(speaker, rule.tree, _symbols(speaker)), _written(speaker, rule.tree, number)
    return (" = ", names) if names == numbers else (" = ", names, " = ", numbers)


def _symbols(speaker: Speaker) -> Callable[[str], Formula]:
    """Return how to write a name of the assignment's formulas."""
    driver = speaker.subject.plan.mechanism.driver
    known: dict[str, Formula] = {scale: speaker.scale(scale) for scale in SCALE_NAMES}
    known["force"] = speaker.symbol("F_max")
    if isinstance(driver, Crank):
        arm = speaker.symbol(driver.pivot, driver.pin)
        drawn = Piece(speaker.tongue.gettext(DRAWN), -1)
        known |= {"omega": speaker.symbol(f"omega_{driver.link}"), "crank_m": arm}
        known["crank_mm"] = Name((*arm.pieces, drawn), f"{arm.plain}_{drawn.text}")
    else:
        known["speed"] = speaker.symbol(f"v_{driver.pin}")
    return lambda name: known.get(name) or _given(speaker, name, name)


def _given(speaker: Speaker, formula: str, otherwise: str) -> Formula:
    """Return the label of the given datum that a formula is, as students know it."""
    data = speaker.subject.assignment.file.given
    label = next((datum.label for datum in data if datum.value.text == formula), otherwise)
    return Name(pieces_of(label), label)


def _written(speaker: Speaker, node: ast.expr, named: Callable[[str], Formula]) -> Formula:
    """Typeset an authored formula."""

    def part(inner: ast.expr) -> Formula:
        is_sum = isinstance(inner, ast.BinOp) and isinstance(inner.op, ast.Add | ast.Sub | ast.Mod)
        return ("(", _written(speaker, inner, named), ")") if is_sum else _written(speaker, inner, named)

    match node:
        case ast.Constant(value=int() | float() as value):
            return speaker.bare(float(value))
        case ast.Name(id="pi"):
            return "π"
        case ast.Name(id=name):
            return named(name)
        case ast.UnaryOp(operand=operand):
            return ("−", part(operand))
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return Fraction(_written(speaker, left, named), _written(speaker, right, named))
        case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=2)):
            return (part(left), "²")
        case ast.BinOp(left=left, op=operator, right=right):
            sign = {ast.Mult: " · ", ast.Add: " + ", ast.Sub: " − ", ast.Pow: "^"}.get(
                type(operator), " mod "
            )
            return (part(left), sign, part(right))
        case ast.Call(func=ast.Name(id=function), args=arguments):
            inner = [piece for one in arguments for piece in ("; ", _written(speaker, one, named))][1:]
            return (function, "(", *inner, ")")
    raise AssertionError(f"an unchecked node {node!r}")  # pragma: no cover
