"""What questions return besides arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .arrays import Floats, Ids, Rows


class CellPath(NamedTuple):
    """The shortest path between two places of a cell, of `Cell.path`."""

    points: Floats  #: (N, 3), um: the first place, each sample on the way, the last place
    along: Floats  #: (N,), um from the first place
    samples: Ids  #: (N,), int64 sample ids; -1 for a place between two samples

    @property
    def length(self) -> float:
        """um along the neurite.

        >>> c.path(5, 1).length
        40.0
        """
        return float(self.along[-1])

    @property
    def straight(self) -> float:
        """um from end to end.

        >>> c.path(5, 1).straight
        40.0
        """
        return float(np.linalg.norm(self.points[-1] - self.points[0]))

    def __repr__(self) -> str:
        return f"<filiform.CellPath of {len(self.points)} points: {self.length:.2f} um, {self.straight:.2f} um straight>"


class LevelSegments(NamedTuple):
    """The segments that draw a box, of `Set.levels`."""

    segments: Rows  #: fields x0 y0 z0 x1 y1 z1 radius type cell; float64 um, float32 um, uint16, uint32
    error: float  #: um: no neurite of the set is farther from its drawn form
    hidden: int  #: segments of the set that are left out, because others cover their pixels
    limited: bool  #: True: coarser than one pixel, because of the limit on segments

    def __repr__(self) -> str:
        limited = ", limited" if self.limited else ""
        return f"<filiform.LevelSegments: {len(self.segments)} segments, error {self.error:.3g} um, {self.hidden} hidden{limited}>"


class Density(NamedTuple):
    """The length of neurite in each box of a grid, of `Set.density`."""

    density: Floats  #: (boxes along x, y, z): um of neurite per um3
    origin: Floats  #: (3,), um: the lowest corner of the first box
    step: float  #: um: the edge of the boxes

    def __repr__(self) -> str:
        x, y, z = self.density.shape
        total = float(self.density.sum()) * self.step**3
        return f"<filiform.Density: {x} x {y} x {z} boxes of {self.step:g} um, {total:.1f} um of neurite>"


class GroupedDensity(NamedTuple):
    """The length of neurite in each box of a grid by cell, by type or both, of `Set.density`."""

    #: one row for each box, cell and type with neurite: ``x y z`` uint32, the box along each axis; ``cell`` uint32;
    #: ``type`` int32; ``length`` float64, um. ``cell`` and ``type`` are 0 where they are not asked for.
    rows: Rows
    origin: Floats  #: (3,), um: the lowest corner of the first box
    step: float  #: um: the edge of the boxes
    shape: tuple[int, int, int]  #: boxes along x, y, z

    def __repr__(self) -> str:
        x, y, z = self.shape
        return f"<filiform.GroupedDensity: {len(self.rows)} rows in {x} x {y} x {z} boxes of {self.step:g} um>"
