"""Making tile sets."""

from __future__ import annotations

import errno
import math
import os
from typing import Any, Callable, Iterable, Iterator, NamedTuple, Sequence, Union

import numpy as np

from . import _core

Path = Union[str, "os.PathLike[str]"]
_COLUMNS = ("source", "x_um", "y_um", "z_um", "qw", "qx", "qy", "qz", "name")


class Record(NamedTuple):
    """One thing that `filiform.ingest` dropped, cut, left out or kept with a remark."""

    input: str  #: the file, or archive and entry
    line: int  #: from 1; 0: no particular line
    code: str  #: such as ``"W_CYCLE"``
    effect: str  #: kept, dropped, cut or left_out
    token: str  #: the text at that place, cut; empty after the first 100 of a code


class Records:
    """The records of an ingest, as ``filiform ingest --report`` writes them. Iterating reads them anew each time.

    There may be millions: they stay packed, in a temporary file beyond 1 MiB. A pickle holds them as a list.
    """

    def __init__(self, count: int, read: Callable[[], Iterable[tuple[bytes, int, str, str, bytes]]]) -> None:
        self._count = count
        self._read = read

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[Record]:
        for name, line, code, effect, token in self._read():
            yield Record(_decoded(name), line, code, effect, _decoded(token))

    def __reduce__(self) -> tuple[Any, ...]:
        return list, (list(self),)

    def __repr__(self) -> str:
        return f"<{len(self)} records>"


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
    refused: list[tuple[str, str]]  #: names of refused files, entries and archives, and why
    skipped: list[tuple[str, str]]  #: names of entries that were left out of archives, and why
    passed_over: dict[str, int]  #: number of files of folders and archives that are no inputs, by ending
    records: Records  #: each dropped line, cut link and remark
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
    one_cell_a_file: bool = False,
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
        columns ``source x_um y_um z_um``, and if wanted ``qw qx qy qz name``. Names may be integers, and may be missing.
    memory : bytes, at least 64 MiB; larger inputs go through a file beside the set.
    threads : 0 is one a processor. levels : write levels of detail, which pictures of large sets need.
    force : replace an existing set. add : add the cells to an existing set.
    one_cell_a_file : keep a file that holds several cells as one; otherwise they become ``FILE/1``, ``FILE/2``, and
        trees without a soma ``FILE/loose``.
    strict : refuse files with a warning; write nothing if a file is refused.
    progress : called as ``progress(phase, done, total)`` at most 20 times a second, on this thread; `total` is 0 if it
        is unknown. An exception that it raises ends the ingest.

    Ctrl-C ends the ingest within a fraction of a second. After any failure an existing set is unchanged, and no new one
    exists. Raises ValueError for input that cannot be used and for a set that exists, OSError.

    >>> report = ff.ingest("L5_1.swc", "one.fil")
    >>> report.cells, report.refused
    (1, [])
    >>> [(record.line, record.code) for record in report.records]
    []
    """
    paths = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    for path in paths:
        name = os.fsdecode(path)
        if "://" not in name and not os.path.exists(path):
            raise FileNotFoundError(errno.ENOENT, "inputs: no such file or folder", name)
        if os.path.basename(name) == "nodes.h5" or _core.is_circuit(os.fsencode(path)):
            raise ValueError(f"inputs: {name} is a circuit; make its set with the program: filiform ingest {name} -o SET")
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
        exponent - 1, apply_offset, one_cell_a_file, strict, levels, force, add, progress,
    )
    for lost in "refused", "skipped":
        result[lost] = [(_decoded(name), _decoded(reason)) for name, reason in result[lost]]
    result["records"] = Records(*result["records"])
    result["summary"] = _decoded(result["summary"])
    result["note"] = _decoded(result["note"])
    return IngestReport(**result)


def _decoded(raw: bytes) -> str:
    return raw.decode("utf-8", "surrogateescape")


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
        cells = [(_name if column in ("source", "name") else _number)(column, value) for column, value in zip(columns, row)]
        if any("\t" in cell or "\n" in cell for cell in cells):
            raise ValueError("placements: names must not hold tabs or line ends")
        lines.append("\t".join(cells))
    return ("\n".join(lines) + "\n").encode("utf-8", "surrogateescape")


def _name(column: str, value: Any) -> str:
    """The text of a name. Integers keep all digits; a missing name of pandas is empty."""
    if isinstance(value, str):
        return value
    if isinstance(value, bytes):
        return _decoded(value)
    if isinstance(value, (int, np.integer)) and not isinstance(value, (bool, np.bool_)):
        return str(int(value))
    if value is None or type(value).__name__ in ("NAType", "NaTType") or (isinstance(value, (float, np.floating)) and value != value):
        return ""
    why = "; pandas makes floats of integers where one is missing, so read the column as text" if isinstance(value, float) else ""
    raise TypeError(f"placements: {column}: expected text or an integer, got {value!r}{why}")


def _number(column: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    try:
        if isinstance(value, bytes):
            return _decoded(value)
        return repr(float(value))
    except (TypeError, ValueError):
        raise TypeError(f"placements: {column}: expected a number, got {value!r}") from None
