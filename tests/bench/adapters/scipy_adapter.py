"""scipy: `fsolve` on the closure equations with their Jacobian, then two linear solves."""

import cmath
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import fsolve

from tests.bench.peers import Answer, NoAnswerError, Places, Plain, Rod, Triangle


class Fsolve:
    """Unknown are the nodes' coordinates: (N - P).(N - P) = l^2 for a link, u x (N - G) = 0 for a guide."""

    def __init__(self, plain: Plain) -> None:
        self.plain = plain
        self.rows = [row for group in plain.groups for row in _rows(group)]
        self.names = [group.node for group in plain.groups]
        self.columns = {name: 2 * k for k, name in enumerate(self.names)}
        self.known: dict[str, complex] = dict(plain.ground)
        self.still = dict.fromkeys(plain.ground, 0j)

    def _gaps(self, x: Any) -> list[float]:
        at = self._places(x)
        told = []
        for node, pin, datum in self.rows:
            if pin is None:
                told.append(_cross(datum[1], at[node] - datum[0]))
            else:
                arm = at[node] - at[pin]
                told.append(arm.real * arm.real + arm.imag * arm.imag - datum * datum)
        return told

    def _jacobian(self, x: Any) -> Any:
        at, column = self._places(x), self.columns
        matrix = np.zeros((len(self.rows), len(self.rows)))
        for row, (node, pin, datum) in enumerate(self.rows):
            if pin is None:
                gradient = 1j * datum[1]
            else:
                gradient = 2.0 * (at[node] - at[pin])
                if pin in column:
                    matrix[row, column[pin]], matrix[row, column[pin] + 1] = -gradient.real, -gradient.imag
            matrix[row, column[node]], matrix[row, column[node] + 1] = gradient.real, gradient.imag
        return matrix

    def _places(self, x: Any) -> dict[str, complex]:
        return self.known | self._pairs(x)

    def _pairs(self, x: Any) -> dict[str, complex]:
        values = x.tolist()
        return {name: complex(values[2 * k], values[2 * k + 1]) for k, name in enumerate(self.names)}

    def solve(self, index: int, start: Places, *, accelerations: bool = True) -> Callable[[], Answer]:
        """The place from the sketch on; velocities and accelerations from the differentiated equations."""
        plain, pin = self.plain, self.plain.pin
        arm, omega, epsilon = plain.arm(index), plain.omega[index], plain.epsilon[index]
        self.known[pin] = plain.ground[plain.pivot] + arm
        guess = np.array([part for name in self.names for part in (start[name].real, start[name].imag)])
        x, _, flag, message = fsolve(self._gaps, guess, fprime=self._jacobian, full_output=True)
        if flag != 1:
            raise NoAnswerError(message)
        at, matrix = self._places(x), self._jacobian(x)
        moved = self.still | {pin: 1j * omega * arm}
        pushed = self.still | {pin: (1j * epsilon - omega**2) * arm}
        try:
            moved |= self._pairs(np.linalg.solve(matrix, self._pull(at, moved)))
            if accelerations:
                pushed |= self._pairs(np.linalg.solve(matrix, self._pull(at, pushed, moved)))
        except np.linalg.LinAlgError as error:
            raise NoAnswerError(str(error)) from error
        return lambda: Answer(at, moved, pushed)

    def _pull(self, at: Places, known: Places, speeds: Places | None = None) -> Any:
        """What the known joints' rates ask of the unknown ones; `speeds` for the second derivative."""
        told = np.zeros(len(self.rows))
        for row, (node, pin, _) in enumerate(self.rows):
            if pin is None:
                continue
            if pin in known:
                told[row] = 2.0 * _dot(at[node] - at[pin], known[pin])
            if speeds is not None:
                between = speeds[node] - speeds[pin]
                told[row] -= 2.0 * _dot(between, between)
        return told


def _rows(group: Triangle | Rod) -> list[tuple[str, str | None, Any]]:
    """(node, pin, length) for a link; (node, None, (through, along)) for a guide."""
    if isinstance(group, Rod):
        line = group.through, cmath.rect(1.0, group.angle)
        return [(group.node, group.pin, group.length), (group.node, None, line)]
    return [(group.node, pin, length) for pin, length in zip(group.pins, group.lengths, strict=True)]


def _dot(u: complex, v: complex) -> float:
    return u.real * v.real + u.imag * v.imag


def _cross(u: complex, v: complex) -> float:
    return u.real * v.imag - u.imag * v.real
