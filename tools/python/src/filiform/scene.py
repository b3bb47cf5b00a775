"""What cells ask of their set, and pictures of what they show. No other module of the package is imported here."""

from __future__ import annotations

from typing import Any, Callable, Protocol, Union

from . import _core
from .arrays import Floats

Progress = Union[Callable[[str, int, int], Any], None]


class Owner(Protocol):
    """The set of a cell."""

    _handle: _core.SetHandle

    @property
    def path(self) -> str: ...

    @property
    def units(self) -> str: ...

    @property
    def closed(self) -> bool: ...

    @property
    def _id(self) -> tuple[str, str]: ...

    def _index_of(self, cell: Any) -> int: ...


class Scene(Protocol):
    """A set, or one cell of it."""

    def _scene(self) -> tuple[Owner, int | None, Floats | None]:
        """The set, and of a cell its index and its bounds."""
        ...
