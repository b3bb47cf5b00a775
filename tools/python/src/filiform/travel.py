"""Travel: one tick at a time, for a device of the caller."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _core
from .arrays import Floats

if TYPE_CHECKING:
    from .set import Set


class Tick(NamedTuple):
    """What one tick of a `Travel` gives."""

    force: Floats  #: (3,), N, in the device's frame: to be given to the hand now; bounded, and changes by little a tick
    proxy: Floats  #: (3,), um: the place on the neurites
    hand: Floats  #: (3,), um: the hand in the tissue
    proxy_on_device: Floats  #: (3,), m: the proxy in the device's frame
    cell: int  #: index of the cell; 2**32 - 1 before the first jump
    segment: int  #: its number in the cell
    t: float  #: the place along the segment: 0 at its end away from the root, 1 at its parent
    visited: int  #: segments tested
    frontier: bool  #: True: a tile is missing; the proxy rests at its border

    def __repr__(self) -> str:
        x, y, z = self.proxy.tolist()
        return f"<filiform.Tick: {np.linalg.norm(self.force):.3f} N, proxy at ({x:.2f}, {y:.2f}, {z:.2f}) um>"


class Travel:
    """A hand that travels a set. The caller is the device: each `tick` takes the hand's position and gives the force.

    Parameters
    ----------
    scene : a `Set`.
    realtime : False: a tick reads the tiles that it needs; the result depends on the calls alone. True: threads read
        tiles; a tick takes what is in memory, never waits, and rests at a frontier.
    method : ``"climb"``, or a method of the paper: basic, shading, force, force-listing.
    zoom : um across 0.12 m of the device. rate : ticks a second. stiffness : N/m. max_force : N. budget : bytes of tiles.

    One thread at a time uses a travel. A forked process opens its own. Use it as a context manager, or call `close`.

    >>> with ff.Travel(s) as travel:
    ...     travel.jump([0, 20, 0])
    ...     for i in range(1000):
    ...         tick = travel.tick([0, 0.00001 * i, 0])
    >>> tick
    <filiform.Tick: ... N, proxy at (0.00, ..., 0.00) um>
    """

    def __init__(
        self,
        scene: "Set",
        *,
        realtime: bool = False,
        method: str = "climb",
        zoom: float = 300.0,
        rate: float = 1000.0,
        stiffness: float = 200.0,
        max_force: float = 8.0,
        budget: Union[int, str, None] = None,
    ) -> None:
        from .set import Set

        if not isinstance(scene, Set):
            raise TypeError(f"scene: expected a Set, got {type(scene).__name__}")
        bytes_of_tiles = _core.parse_bytes("budget", budget) if isinstance(budget, str) else budget
        self.set = scene
        self._data = _core.TravelData(scene._handle, realtime, method, zoom, rate, stiffness, max_force, bytes_of_tiles)

    def jump(self, place: Any) -> None:
        """Move the proxy to a point (um; to the nearest neurite) or to a row of `Set.nearest`.

        The world moves so that the place lies under the hand; the force begins at zero and grows over 0.5 s of ticks.
        Reads tiles: do not call it in a haptic loop.

        >>> travel = ff.Travel(s)
        >>> travel.jump(s.nearest([0, 20, 3]))
        >>> travel.tick([0, 0, 0]).proxy
        array([ 0., 20.,  0.])
        """
        if isinstance(place, np.void) and place.dtype.names and {"cell", "segment", "x", "y", "z"} <= set(place.dtype.names):
            self._data.jump([place["x"], place["y"], place["z"]], (int(place["cell"]), int(place["segment"])))
        else:
            self._data.jump(place, None)

    def tick(self, hand: npt.ArrayLike, dt: float = 0.001) -> Tick:
        """One tick: the hand is at `hand` (m, in the device's frame), `dt` seconds after the last tick.

        With realtime, it takes microseconds. Otherwise it may read tiles; after an error the force is zero, and the next
        tick tries again.

        >>> travel = ff.Travel(s)
        >>> travel.jump([0, 20, 0])
        >>> for i in range(600):
        ...     tick = travel.tick([0.001, 0, 0])  # 1 mm to the right of where the hand was
        >>> tick.force.round(1)
        array([...])
        """
        return Tick(*self._data.tick(hand, dt))

    def zoom(self, factor: float) -> None:
        """Multiply the zoom about the proxy.

        >>> travel = ff.Travel(s)
        >>> travel.jump([0, 20, 0])
        >>> travel.zoom(2)
        """
        self._data.zoom(factor)

    def rotate(self, about_x: float, about_y: float) -> None:
        """Turn the world about the screen's axes through the proxy, radians.

        >>> travel = ff.Travel(s)
        >>> travel.jump([0, 20, 0])
        >>> travel.rotate(0, 0.5)
        """
        self._data.rotate(about_x, about_y)

    def centre(self) -> None:
        """Bring the proxy to the centre of the workspace, slowly.

        >>> travel = ff.Travel(s)
        >>> travel.jump([0, 20, 0])
        >>> travel.centre()
        """
        self._data.centre()

    def residency(self) -> dict[str, int]:
        """Counters of the travel's tiles. Takes a lock: do not call it in a haptic loop.

        >>> travel = ff.Travel(s)
        >>> travel.jump([0, 20, 0])
        >>> travel.residency()["reads"]
        1
        """
        return self._data.residency()

    def close(self) -> None:
        """End the travel and its threads.

        >>> travel = ff.Travel(s)
        >>> travel.close()
        >>> travel
        <filiform.Travel in 'column.fil', closed>
        """
        self._data.close()

    def __enter__(self) -> Travel:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        name = self.set.path.rstrip("/").rsplit("/", 1)[-1]
        return f"<filiform.Travel in {name!r}{', closed' if self._data.closed else ''}>"
