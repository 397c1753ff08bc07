"""Some variants of a mechanism's arrays, in other kinds of numbers."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.solving import Take


def each_number_once(values: Any) -> Any:  # noqa: ANN401 - an array, or a side that all variants share
    """Takes all variants at once; what they share and an array only repeats, one time."""
    return values[:1] if type(values) is not int and values.strides == (0,) else values


def a_stretch(rows: slice) -> Take:
    """Takes neighbouring variants; what all variants share, one time."""

    def take(values: Any) -> Any:  # noqa: ANN401 - as above
        once = each_number_once(values)
        return once if type(once) is int or once.size == 1 else once[rows]

    return take


def one_variant(index: int, number: Callable[[Any], Any] | None = None, *, among: int | None = None) -> Take:
    """Takes the numbers of one variant out of arrays over variants (those of one entry hold for all).

    Arguments: `number` makes another kind of number of a float or complex; `among`, where given, is the
    number of variants, and an array of another size raises ValueError.
    """

    def take(values: Any) -> Any:  # noqa: ANN401 - an array, or a side that all variants share
        if type(values) is int:
            return values
        if values.size == 1:
            one = values.item()
        elif among in {None, values.size}:
            one = values.item(index)
        else:
            raise ValueError(f"data of {values.size} variants in a mechanism whose driver has {among}")
        return one if number is None else number(one)

    return take


def some_variants(rows: NDArray[np.intp]) -> Take:
    """Takes some variants out of arrays over variants, in the widest floats there are."""

    def take(values: Any) -> Any:  # noqa: ANN401 - an array, or a side that all variants share
        if type(values) is int:
            return values
        chosen = values if values.size == 1 else values[rows]
        return chosen.astype(np.clongdouble if np.iscomplexobj(chosen) else np.longdouble)

    return take
