"""The fields that a caller chooses of rows."""

from __future__ import annotations

from typing import Any, Iterable, Sequence, Union

import numpy as np

from . import _core
from .arrays import Array

Fields = Union[str, Sequence[str], None]
_ENDS = ("x0", "y0", "z0", "x1", "y1", "z1")


def names(fields: Union[str, Iterable[str]], known: Sequence[str]) -> tuple[str, ...]:
    """The names, checked; text is one name, or several with commas between."""
    chosen = tuple(name.strip() for name in fields.split(",")) if isinstance(fields, str) else tuple(fields)
    for name in chosen:
        if name not in known:
            raise ValueError(f"fields: unknown field {name!r}; choose from {' '.join(known)}")
    if len(set(chosen)) != len(chosen) or not chosen:
        raise ValueError("fields: give each field once, and at least one")
    return chosen


def is_single(fields: Fields) -> bool:
    """True for the name of one field, which gives its values instead of rows."""
    return isinstance(fields, str) and "," not in fields


def of_hits(fields: Union[str, Iterable[str]]) -> tuple[str, ...]:
    return names(fields, tuple(_core.HIT.names or ()) + _ENDS)


def wants_ends(fields: Fields) -> bool:
    return fields is not None and any(name in _ENDS for name in of_hits(fields))


def select(rows: Array, ends: Array | None, fields: Fields) -> Array:
    """The fields of hits; `ends` has the six of _ENDS."""
    if fields is None:
        return rows

    def column(name: str) -> Array:
        if name in _ENDS:
            assert ends is not None
            return ends[:, _ENDS.index(name)]
        return rows[name]

    chosen = of_hits(fields)
    if is_single(fields):
        return np.ascontiguousarray(column(chosen[0]))
    result = np.empty(len(rows), dtype=[(name, column(name).dtype) for name in chosen])
    for name in chosen:
        result[name] = column(name)
    return result


def of_segments(fields: Fields) -> np.dtype[Any]:
    """The rows of `Set.segments` with these fields; None: all but length."""
    known = _core.SEGMENT.names or ()
    chosen = known[:-1] if fields is None else names(fields, known)
    return np.dtype([(name, _core.SEGMENT[name]) for name in chosen])
