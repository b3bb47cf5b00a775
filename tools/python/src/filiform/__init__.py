"""Nearest neurites, paths, travels and pictures of whole neuronal columns.

    import filiform as ff
    s = ff.open("column.fil")
    hits = s.nearest([[120.0, -40.0, 800.0]], k=3)

Positions and lengths are in micrometres (um), forces in newtons. Results are NumPy arrays with named fields. Any number
of threads may use one Set; long calls release the global lock, and Ctrl-C ends them.

Errors: ValueError for a wrong shape or value, TypeError for what is no number, KeyError for an unknown cell or sample,
OSError for a file or server that cannot be read, CorruptSet for damaged files. The text names the argument or file.
"""

from ._core import CorruptSet, version as __version__
from .cell import Cell
from .cells import CellList, Cells
from .making import CheckedInput, CheckReport, IngestReport, Record, Records, VerifyReport, check, compact, ingest, remove, synth, verify
from .navigation import Navigation
from .pictures import render
from .results import CellPath, Density, GroupedDensity, LevelSegments
from .set import Set, open
from .travel import Tick, Travel
from .view import View

__all__ = [
    "Cell",
    "CellList",
    "CellPath",
    "Cells",
    "CheckReport",
    "CheckedInput",
    "CorruptSet",
    "Density",
    "GroupedDensity",
    "IngestReport",
    "LevelSegments",
    "Navigation",
    "Record",
    "Records",
    "Set",
    "Tick",
    "Travel",
    "VerifyReport",
    "View",
    "check",
    "compact",
    "ingest",
    "open",
    "remove",
    "render",
    "synth",
    "verify",
]
