"""Records of arrays (mechanisms, groups, guides): one variant taken out, variants put together."""

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def one_of(record: Any, index: int, number: Callable[[Any], Any]) -> Any:
    """A record with the numbers of one variant, as `number` makes them, in place of its arrays."""
    match record:
        case np.ndarray():
            return number(record.item(0 if record.size == 1 else index))
        case tuple():
            return tuple(one_of(item, index, number) for item in record)
        case dict():
            return {name: one_of(item, index, number) for name, item in record.items()}
    if not is_dataclass(record) or isinstance(record, type):
        return record
    told = {each.name: one_of(getattr(record, each.name), index, number) for each in fields(record)}
    return type(record)(**told)


def stacked(records: Sequence[Any]) -> Any:
    """Records alike but for their numbers, of one variant each, as one record of many variants."""
    first = records[0]
    match first:
        case np.ndarray():
            return np.concatenate(records)
        case tuple():
            return tuple(stacked(items) for items in zip(*records, strict=True))
        case dict():
            return {name: stacked([record[name] for record in records]) for name in first}
    if not is_dataclass(first) or isinstance(first, type):
        return first if len(set(records)) == 1 else np.array(records)
    told = {each.name: stacked([getattr(one, each.name) for one in records]) for each in fields(first)}
    return type(first)(**told)
