"""Navigation: a travelled route, tick by tick."""

from __future__ import annotations

from typing import Any

import numpy as np

from .arrays import Floats, Rows


class Navigation:
    """What `Set.navigate` returns: one row a tick, and a summary."""

    def __init__(self, ticks: Rows, summary: dict[str, Any]) -> None:
        summary["cell"] = summary["cell"].decode("utf-8", "surrogateescape")
        self.ticks = ticks  #: structured array (T,): time hand proxy force cell segment visited frontier
        self.summary = summary  #: totals, as ``filiform navigate --json`` names them

    @property
    def outcome(self) -> str:
        """``"completed"``, ``"stuck"`` or ``"time_over"``.

        >>> s.navigate("L5_1", route="5:3").outcome
        'completed'
        """
        return str(self.summary["outcome"])

    @property
    def time(self) -> Floats:
        """(T,), s.

        >>> s.navigate("L5_1", seconds=0.1).time[-1].round(3)
        0.099
        """
        return self.ticks["time"]

    @property
    def hand(self) -> Floats:
        """(T, 3), um: where the hand is in the tissue.

        >>> s.navigate("L5_1", seconds=0.1).hand.shape
        (100, 3)
        """
        return self.ticks["hand"]

    @property
    def proxy(self) -> Floats:
        """(T, 3), um: where the proxy is on the neurites.

        >>> s.navigate("L5_1", seconds=0.1).proxy.shape
        (100, 3)
        """
        return self.ticks["proxy"]

    @property
    def force(self) -> Floats:
        """(T, 3), N, in the device's frame: what the hand feels.

        >>> bool((np.linalg.norm(s.navigate("L5_1", seconds=0.1).force, axis=1) <= 8).all())
        True
        """
        return self.ticks["force"]

    def __len__(self) -> int:
        return len(self.ticks)

    def __repr__(self) -> str:
        most = float(np.linalg.norm(self.force, axis=1).max()) if len(self) else 0.0
        return (
            f"<filiform.Navigation on {self.summary['cell']!r}: {self.outcome}, "
            f"{self.summary['reached_um']:.1f} of {self.summary['route_um']:.1f} um in {len(self)} ticks, "
            f"at most {most:.2f} N>"
        )
