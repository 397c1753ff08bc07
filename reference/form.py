"""What a mechanism is apart from its numbers: the arrays in it, replaced or set aside."""

from collections.abc import Callable, Mapping
from types import NoneType
from typing import Any, TypeVar, cast

import numpy as np

from reference.mechanism import Mechanism

Array = np.ndarray[Any, np.dtype[Any]]
"""Real or complex: one number for all variants, or one for each."""
Part = TypeVar("Part")
PLAIN = (str, int, float, complex, NoneType)
"""What a mechanism is made of besides records, tuples, mappings and arrays."""


def with_arrays(part: Part, change: Callable[[Array], Any]) -> Part:
    """A mechanism, or a part of it, with every array replaced, in the order of its fields."""
    return cast("Part", _changed(part, change))


def _changed(part: Any, change: Callable[[Array], Any]) -> Any:  # noqa: ANN401 - whatever a part is made of
    if isinstance(part, np.ndarray):
        return change(part)
    if isinstance(part, PLAIN):
        return part
    if isinstance(part, tuple):
        return tuple([_changed(inner, change) for inner in part])
    if isinstance(part, Mapping):
        return {name: _changed(inner, change) for name, inner in part.items()}
    return type(part)(*[_changed(getattr(part, name), change) for name in part.__slots__])


def form_of(mechanism: Mechanism) -> tuple[object, ...]:
    """All of a mechanism except the values of its arrays; equal for mechanisms with one construction."""
    form: list[object] = []
    _collect(mechanism, form)
    return tuple(form)


def _collect(part: object, form: list[object]) -> None:
    if isinstance(part, np.ndarray):
        form.append(part.dtype.kind)
    elif isinstance(part, PLAIN):
        form.append(part)
    else:
        form.append(type(part))
        for inner in _inside(part):
            _collect(inner, form)


def _inside(part: Any) -> list[object]:  # noqa: ANN401 - a record, a tuple or a mapping
    if isinstance(part, tuple):
        return [len(part), *part]
    if isinstance(part, Mapping):
        return [len(part), *part.keys(), *part.values()]
    return [getattr(part, name) for name in part.__slots__]
