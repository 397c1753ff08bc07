"""From a program to steps for `reference.machine`: what is fused, in what order, in which registers.

A register holds one real number of each variant of a block. Products that are used once are fused
with the sum they go into; what is the same for all variants is calculated once, before all blocks.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from reference.noted import Node, Op
from reference.program import Program

WIDTH = 6
"""A step: operation, the register of the result, four operands. A store: the row of the results first."""


@dataclass(frozen=True, slots=True)
class Steps:
    """What the machine carries out.

    Attributes
    ----------
    once, each : (M, 6) int32, for all variants together and for each block of them
    constants : the first registers, shape (C,)
    registers : how many there are
    """

    once: NDArray[np.int32]
    each: NDArray[np.int32]
    constants: NDArray[np.float64]
    registers: int


def lower(program: Program) -> Steps:
    """The steps of a program."""
    return _Lowering(program).steps()


@dataclass(slots=True)
class _Lowering:
    program: Program
    nodes: list[Node] = field(init=False)
    wanted: list[int] = field(init=False)
    uses: dict[int, int] = field(init=False)
    order: list[int] = field(default_factory=list)
    shared: dict[int, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.nodes = list(self.program.nodes)
        ends = [end for plane in self.program.planes for end in plane] + list(self.program.reals)
        self.wanted = ends
        self.uses = dict.fromkeys(ends, 1)
        for index in range(len(self.nodes) - 1, -1, -1):
            if index in self.uses:
                for operand in _operands(self.nodes[index]):
                    self.uses[operand] = self.uses.get(operand, 0) + 1
        self._fuse()
        placed: set[int] = set()
        for end in ends:
            self._need(end, placed)
        for index in self.order:
            self.shared[index] = self._is_shared(index)

    def _is_shared(self, index: int) -> bool:
        op, *operands = self.nodes[index]
        if op is Op.INPUT:
            return self.program.shared[operands[0]]
        return all(self.shared[operand] for operand in operands if op is not Op.CONSTANT)

    def _fuse(self) -> None:
        """Sums and differences of products as single steps."""
        for index, (op, *operands) in enumerate(self.nodes):
            if (op is Op.ADD or op is Op.SUB) and index in self.uses:
                a, b = (self._product(operand) for operand in operands)
                fused = _fused(op, operands, a, b)
                if fused is not None:
                    self.nodes[index] = fused

    def _product(self, index: int) -> tuple[int, int] | None:
        op, *operands = self.nodes[index]
        alone = op is Op.MUL and self.uses[index] == 1 and index not in self.wanted
        return (operands[0], operands[1]) if alone else None

    def _need(self, end: int, placed: set[int]) -> None:
        """Put a node, and first what it needs, in order: nothing is calculated long before its use."""
        waiting = [end]
        while waiting:
            index = waiting[-1]
            missing = [one for one in _operands(self.nodes[index]) if one not in placed]
            if missing:
                waiting.extend(reversed(missing))
            else:
                waiting.pop()
                if index not in placed:
                    placed.add(index)
                    self.order.append(index)

    def steps(self) -> Steps:
        """Registers by linear scan: constants and what is shared keep theirs, others are used again."""
        constants = [index for index in self.order if self.nodes[index][0] is Op.CONSTANT]
        shared = [index for index in self.order if self.shared[index] and index not in set(constants)]
        register = {index: place for place, index in enumerate((*constants, *shared))}
        once = [self._step(index, register) for index in shared]
        stores = self._stores()
        rest = [index for index in self.order if not self.shared[index]]
        events: list[int | tuple[int, ...]] = [
            *(store for index in (*constants, *shared) for store in stores.get(index, ())),
        ]
        for index in rest:
            events.append(index)
            events.extend(stores.get(index, ()))
        last: dict[int, int] = {}
        for when, event in enumerate(events):
            for operand in _operands(self.nodes[event]) if isinstance(event, int) else event[2:]:
                last[operand] = when
        free: list[int] = []
        registers = len(register)
        each = []
        for when, event in enumerate(events):
            if isinstance(event, int):
                operands = _operands(self.nodes[event])
                if not free:
                    free.append(registers)
                    registers += 1
                register[event] = free.pop()
                each.append(self._step(event, register))
            else:
                operands = event[2:]
                each.append((*event[:2], *(register[operand] for operand in operands)))
            free.extend(
                register[operand]
                for operand in dict.fromkeys(operands)
                if last[operand] == when and not self.shared[operand]
            )
        return Steps(
            _table(once),
            _table(each),
            np.array([self.nodes[index][1] for index in constants], dtype=np.float64),
            registers,
        )

    def _step(self, index: int, register: dict[int, int]) -> tuple[int, ...]:
        op, *operands = self.nodes[index]
        if op is Op.INPUT:
            own = Op.LOAD_PART if len(operands) == 2 else Op.LOAD
            load = Op.LOAD_SHARED if self.program.shared[operands[0]] else own
            return (load, register[index], *operands)
        return (op, register[index], *(register[operand] for operand in operands))

    def _stores(self) -> dict[int, list[tuple[int, ...]]]:
        """By node, the results that are complete with it: operation, row, and the nodes stored."""
        when = {index: place for place, index in enumerate(self.order)}
        shared = {index for index in self.order if self.shared[index]}
        stores: dict[int, list[tuple[int, ...]]] = {}

        def after(*nodes: int) -> list[tuple[int, ...]]:
            last = max(nodes, key=lambda node: (node not in shared, when[node]))
            return stores.setdefault(last, [])

        for row, plane in enumerate(self.program.planes):
            after(*plane).append((Op.STORE_PLANE, row, *plane))
        for row, real in enumerate(self.program.reals):
            after(real).append((Op.STORE, row, real))
        return stores


def _operands(node: Node) -> tuple[int, ...]:
    op = node[0]
    return () if op is Op.INPUT or op is Op.CONSTANT else node[1:]


def _fused(op: Op, operands: list[int], a: tuple[int, int] | None, b: tuple[int, int] | None) -> Node | None:
    if a and b:
        return (Op.DOT if op is Op.ADD else Op.CROSS, *a, *b)
    if a:
        return (Op.MUL_ADD if op is Op.ADD else Op.MUL_SUB, *a, operands[1])
    if b:
        return (Op.MUL_ADD if op is Op.ADD else Op.SUB_MUL, *b, operands[0])
    return None


def _table(steps: list[tuple[int, ...]]) -> NDArray[np.int32]:
    table = np.zeros((len(steps), WIDTH), dtype=np.int32)
    for row, step in enumerate(steps):
        table[row, : len(step)] = step
    return table
