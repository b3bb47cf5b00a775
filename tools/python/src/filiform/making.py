"""Making tile sets."""

from __future__ import annotations

import errno
import math
import os
from typing import Any, Callable, NamedTuple, Sequence, Union

from . import _core

Path = Union[str, "os.PathLike[str]"]
_COLUMNS = ("source", "x_um", "y_um", "z_um", "qw", "qx", "qy", "qz", "name")


class IngestReport(NamedTuple):
    """What `filiform.ingest` wrote."""

    revision: str
    cells: int
    samples: int
    segments: int
    tiles: int
    bytes: int
    unchanged: bool  #: with `force`: the set was the same already, and was kept
    accepted: int  #: inputs that became cells
    refused: list[tuple[str, str]]  #: names of refused inputs, and why
    summary: str  #: a few lines for people: what was kept, dropped and cut
    note: str  #: not empty: the unit looks wrong


def ingest(
    inputs: Union[Path, Sequence[Path]],
    output: Path,
    *,
    unit: str = "um",
    placements: Any = None,
    memory: Union[int, str] = "1GiB",
    threads: int = 0,
    levels: bool = True,
    force: bool = False,
    add: bool = False,
    strict: bool = False,
    apply_offset: bool = False,
    capacity: int = 2048,
    quantum: float = 2.0**-9,
    progress: Callable[[str, int, int], Any] | None = None,
) -> IngestReport:
    """Make a tile set from SWC files, folders, archives and graphs, in bounded memory.

    Parameters
    ----------
    inputs : a path or several: what ``filiform ingest`` reads, but for circuits.
    output : the folder of the set, such as ``"column.fil"``.
    unit : of the files: ``"um"``, ``"nm"``, ``"mm"``, or the size of a voxel, such as ``"8nm"`` or ``"8,8,30nm"``.
    placements : makes the input a library. A path of a table, or a pandas DataFrame, structured array or dict with the
        columns ``source x_um y_um z_um``, and if wanted ``qw qx qy qz name``.
    memory : bytes, at least 64 MiB; larger inputs go through a file beside the set.
    threads : 0 is one a processor. levels : write levels of detail, which pictures of large sets need.
    force : replace an existing set. add : add the cells to an existing set.
    strict : refuse files with a warning; write nothing if a file is refused.
    progress : called as ``progress(phase, done, total)`` at most 20 times a second, on this thread; `total` is 0 if it
        is unknown. An exception that it raises ends the ingest.

    Ctrl-C ends the ingest within a fraction of a second. After any failure an existing set is unchanged, and no new one
    exists. Raises ValueError for input that cannot be used and for a set that exists, OSError.
    """
    paths = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    for path in paths:
        name = os.path.basename(os.fsdecode(path)).lower()
        if name.endswith(".json") or name == "nodes.h5":
            raise ValueError(f"inputs: {name} is a circuit; make its set with the program: filiform ingest {name} -o SET")
        if "://" not in os.fsdecode(path) and not os.path.exists(path):
            raise FileNotFoundError(errno.ENOENT, "inputs: no such file or folder", os.fsdecode(path))
    if isinstance(memory, str):
        memory = _core.parse_bytes("memory", memory)
    mantissa, exponent = math.frexp(quantum)
    if mantissa != 0.5 or not -10 <= exponent - 1 <= 10:
        raise ValueError("quantum: give a power of two from 2**-10 to 2**10 um")
    if progress is not None and not callable(progress):
        raise TypeError("progress: expected a function of phase, done and total")
    table = b"" if placements is None else _table(placements)
    result = _core.ingest(
        [os.fsencode(path) for path in paths], os.fsencode(output), unit, table, memory, threads, capacity,
        exponent - 1, apply_offset, strict, levels, force, add, progress,
    )

    def decoded(raw: bytes) -> str:
        return raw.decode("utf-8", "surrogateescape")

    result["refused"] = [(decoded(name), decoded(reason)) for name, reason in result["refused"]]
    result["summary"] = decoded(result["summary"])
    result["note"] = decoded(result["note"])
    return IngestReport(**result)


def _table(placements: Any) -> bytes:
    """The table of placements as tab-separated text."""
    if isinstance(placements, (str, os.PathLike)):
        with open(placements, "rb") as file:
            return file.read()
    names = getattr(placements, "columns", None)
    if names is None:
        dtype = getattr(placements, "dtype", None)
        names = dtype.names if dtype is not None else list(placements)
    columns = {}
    for name, default in zip(_COLUMNS, (None, None, None, None, 1.0, 0.0, 0.0, 0.0, "")):
        if name in names:
            columns[name] = list(placements[name])
        elif default is None:
            raise ValueError(f"placements: the column {name} is missing; it needs source x_um y_um z_um")
        else:
            columns[name] = [default] * len(placements["source"])
    lines = ["\t".join(_COLUMNS)]
    for row in zip(*columns.values()):
        cells = [value if isinstance(value, str) else repr(float(value)) for value in row]
        if any("\t" in cell or "\n" in cell for cell in cells):
            raise ValueError("placements: names must not hold tabs or line ends")
        lines.append("\t".join(cells))
    return ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape")
