"""Making, checking and keeping tile sets: what the commands ingest, check, verify and compact do."""

from __future__ import annotations

import contextlib
import errno
import math
import operator
import os
import tempfile
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator, Mapping, NamedTuple, Sequence, Union

import numpy as np

from . import _core, neurons
from .cells import CellList
from .scene import Progress

if TYPE_CHECKING:
    from .set import Set

Path = Union[str, "os.PathLike[str]"]
_COLUMNS = ("source", "x_um", "y_um", "z_um", "qw", "qx", "qy", "qz", "name")


class Record(NamedTuple):
    """One thing that a reader dropped, cut, left out or kept with a remark."""

    input: str  #: the file, or archive and entry
    line: int  #: from 1; 0: no particular line
    code: str  #: such as ``"W_CYCLE"``
    effect: str  #: kept, dropped, cut or left_out
    token: str  #: the text at that place, cut; empty after the first 100 of a code
    text: str  #: what the code means


class Records:
    """The records of an ingest or a check, as ``--report`` writes them. Iterating reads them anew each time.

    There may be millions: they stay packed, in a temporary file beyond 1 MiB. A pickle holds them as a list.
    """

    def __init__(self, count: int, read: Callable[[], Iterable[tuple[bytes, int, str, str, bytes, str]]]) -> None:
        self._count = count
        self._read = read

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[Record]:
        for name, line, code, effect, token, text in self._read():
            yield Record(_decoded(name), line, code, effect, _decoded(token), text)

    def __reduce__(self) -> tuple[Any, ...]:
        return list, (list(self),)

    def __repr__(self) -> str:
        return f"<{len(self)} records>"


class CheckedInput(NamedTuple):
    """One file or entry of an archive that was read."""

    name: str
    fate: str  #: accepted, warned, skipped or refused
    reason: str  #: of a skipped or refused one
    samples: int  #: kept
    segments: int  #: kept


class IngestReport(NamedTuple):
    """What `filiform.ingest`, `remove` or `compact` wrote."""

    revision: str
    cells: int
    samples: int
    segments: int
    tiles: int
    bytes: int
    unchanged: bool  #: with `force` or `sync`: the set was the same already, and was kept
    accepted: int = 0  #: inputs that became cells
    refused: list[tuple[str, str]] = []  #: names of refused files, entries and archives, and why
    skipped: list[tuple[str, str]] = []  #: names of entries that were left out of archives, and why
    passed_over: dict[str, int] = {}  #: number of files of folders and archives that are no inputs, by ending
    files: list[CheckedInput] = []  #: each input, with its fate
    records: Union[Records, list[Record]] = []  #: each dropped line, cut link and remark
    summary: str = ""  #: a few lines for people: what was kept, dropped and cut
    note: str = ""  #: not empty: the unit or a table looks wrong
    changes: dict[str, int] = {}  #: of `sync`: cells ``added changed equal removed gone held renamed``

    def __repr__(self) -> str:
        lost = f", {len(self.refused)} refused" if self.refused else ""
        return f"<filiform.IngestReport: {self.cells} cells, {self.segments} segments in {self.tiles} tiles{lost}>"


class CheckReport(NamedTuple):
    """What `filiform.check` found."""

    accepted: int  #: inputs that would become cells
    refused: list[tuple[str, str]]  #: names of refused files, entries and archives, and why
    skipped: list[tuple[str, str]]  #: names of entries that are left out of archives, and why
    passed_over: dict[str, int]  #: number of files of folders and archives that are no inputs, by ending
    files: list[CheckedInput]  #: each input, with its fate
    records: Records  #: each dropped line, cut link and remark
    summary: str  #: a few lines for people
    note: str  #: not empty: the unit looks wrong

    @property
    def ok(self) -> bool:
        """True if no input is refused.

        >>> ff.check("L5_1.swc").ok
        True
        """
        return not self.refused

    def __repr__(self) -> str:
        return f"<filiform.CheckReport: {self.accepted} accepted, {len(self.refused)} refused, {len(self.records)} records>"


class VerifyReport(NamedTuple):
    """What `filiform.verify` found."""

    tiles: int
    bytes: int
    problems: list[str]  #: one line each, at most 100
    problem_count: int

    @property
    def sound(self) -> bool:
        """True without problems.

        >>> ff.verify("column.fil").sound
        True
        """
        return self.problem_count == 0

    def __repr__(self) -> str:
        state = "sound" if self.sound else f"{self.problem_count} problems"
        return f"<filiform.VerifyReport: {state}, {self.tiles} tiles, {self.bytes} bytes>"


def ingest(
    inputs: Any,
    output: Path,
    *,
    unit: str = "um",
    version: str = "cng",
    ids: Union[Path, Sequence[int], None] = None,
    where: Union[str, Sequence[str], None] = None,
    box: Any = None,
    cells: Any = None,
    type: Union[str, Sequence[str], None] = None,
    placements: Any = None,
    attributes: Any = None,
    key: str | None = None,
    population: str = "",
    morphologies: Path = "",
    soma_links: bool = True,
    one_cell_a_file: bool = False,
    apply_offset: bool = False,
    strict: bool = False,
    levels: bool = True,
    capacity: int | None = None,
    quantum: float | None = None,
    memory: Union[int, str] = "1GiB",
    threads: int = 0,
    add: bool = False,
    sync: bool = False,
    delete: bool = False,
    force: bool = False,
    token: str | None = None,
    cache: Path | None = None,
    cache_size: Union[int, str] = "4GiB",
    connections: int = 32,
    progress: Progress = None,
) -> IngestReport:
    """Make a tile set from files, folders, archives, addresses, circuits, neurons in memory or another set.

    Parameters
    ----------
    inputs : a path or address, or several: what ``filiform ingest`` reads. Or neurons in memory, one, a list, or a dict
        of names and neurons: arrays (N, 7) with the columns of SWC; structured arrays and DataFrames with ``node_id
        parent_id x y z`` and perhaps ``radius label``; neurons of navis, whose own unit counts; skeletons with
        ``vertices`` and ``edges``; graphs of networkx from child to parent; each `Cell`. Ids and order of nodes stay.
        Or a `Set`, or a `CellList` of one: its cells with their attributes.
    output : the folder of the set, such as ``"column.fil"``.
    unit : of the files, and of neurons that state none: ``"um"``, ``"nm"``, ``"mm"``, or the size of a voxel, such as
        ``"8nm"`` or ``"8,8,30nm"``.
    version : of neurons that a NeuroMorpho archive holds twice: ``"cng"``, ``"source"`` or ``"both"``.
    ids, where, box : of Neuroglancer skeletons, the objects to read: ids or a file of them, one a line; conditions on
        segment properties, such as ``"layer>=4"``; a box (2, 3), um. Of a set: conditions and box choose cells.
    cells, type : of a set: names, and only samples of these types.
    placements : makes the input a library. A path of a table, or a pandas DataFrame, structured array or dict with the
        columns ``source x_um y_um z_um``, and if wanted ``qw qx qy qz name``. Names may be integers, and may be missing.
    attributes, key : a path of a CSV or TSV table, or a DataFrame, structured array or dict, with a row a cell, and its
        column with the names of cells. Its columns stay with the cells: `Set.where`.
    population, morphologies : of a circuit: read only this population; where its morphologies are.
    soma_links : link the soma to its neurites in formats that state no such links (H5, ASC).
    one_cell_a_file : keep a file that holds several cells as one; otherwise they become ``FILE/1``, ``FILE/2``, and
        trees without a soma ``FILE/loose``.
    apply_offset : add the OFFSET of each header to its positions.
    strict : refuse files with a warning; write nothing if a file is refused.
    levels : write levels of detail, which pictures of large sets need.
    capacity, quantum : segments a tile, default 2048; the grid of positions, a power of two, default 2**-9 um.
    memory : bytes, at least 64 MiB; larger inputs go through a file beside the set. threads : 0 is one a processor.
    add : add the cells to an existing set. force : replace one.
    sync : make the set follow its inputs: add new cells, replace changed ones. delete : remove those that are gone.
    token, cache, cache_size, connections : for addresses, as in `open`; requests at once.
    progress : called as ``progress(phase, done, total)`` at most 20 times a second, on this thread; `total` is 0 if it
        is unknown. An exception that it raises ends the ingest.

    Ctrl-C ends the ingest within a fraction of a second. After any failure an existing set is unchanged, and no new one
    exists. Raises ValueError for input that cannot be used and for a set that exists, OSError.

    >>> report = ff.ingest("L5_1.swc", "one.fil")
    >>> report, report.refused
    (<filiform.IngestReport: 1 cells, 4 segments in 1 tiles>, [])
    >>> ff.ingest({"again": c.nodes}, "one.fil", add=True)
    <filiform.IngestReport: 2 cells, 8 segments in 1 tiles>
    >>> ff.ingest(s, "layer5.fil", where="layer=5", type="dendrite").cells
    2
    """
    options = _given(
        unit=(unit, "um"), version=(version, "cng"), apply_offset=(apply_offset, False), strict=(strict, False),
        one_cell_a_file=(one_cell_a_file, False), soma_links=(soma_links, True), population=(population, ""), sync=(sync, False),
        delete=(delete, False), morphologies=(os.fspath(morphologies), ""),
    )
    making = _given(capacity=(capacity, None), levels=(levels, True), force=(force, False), add=(add, False))
    making["memory"] = _bytes("memory", memory)
    making["threads"] = threads
    if quantum is not None:
        mantissa, exponent = math.frexp(quantum)
        if mantissa != 0.5 or not -10 <= exponent - 1 <= 10:
            raise ValueError("quantum: give a power of two from 2**-10 to 2**10 um")
        making["quantum_exponent"] = exponent - 1
    making["progress"] = _callable(progress)
    if isinstance(inputs, (list, tuple)) and len(inputs) == 1 and (isinstance(inputs[0], CellList) or _is_set(inputs[0])):
        inputs = inputs[0]
    if isinstance(inputs, CellList) and inputs and all(cell.set == inputs[0].set for cell in inputs) or _is_set(inputs):
        others = _given(
            placements=(placements, None), attributes=(attributes, None), key=(key, None), ids=(ids, None),
            cache_size=(cache_size, "4GiB"), connections=(connections, 32),
        )
        for name in [*options, *others]:
            raise ValueError(f"{name}: is for files of neurons; inputs is a tile set")
        with _opened(inputs, token, cache) as owner:
            return _ingest_cells(owner, inputs, output, cells, type, where, box, making)
    if cells is not None or type is not None:
        raise ValueError("cells, type: choose from a tile set; inputs is none")
    options.update(making, **_remote(token, cache, cache_size, connections))
    if ids is not None:
        options["ids"] = _object_ids(ids)
    if where is not None:
        options["where"] = [where] if isinstance(where, str) else list(where)
    if box is not None:
        options["box"] = box
    _add_table(options, "placements", placements, None)
    _add_table(options, "attributes", attributes, key)
    with tempfile.TemporaryDirectory(prefix="filiform-neurons-") as folder:
        result = _core.ingest(_paths(inputs, folder, unit), os.fsencode(output), options)
    return IngestReport(**_reported(result))


def check(
    inputs: Any,
    *,
    unit: str = "um",
    version: str = "cng",
    population: str = "",
    morphologies: Path = "",
    soma_links: bool = True,
    one_cell_a_file: bool = False,
    strict: bool = False,
    token: str | None = None,
    cache: Path | None = None,
    progress: Progress = None,
) -> CheckReport:
    """Read inputs as `ingest` does, write nothing, and report what is wrong with them.

    inputs, options and errors are those of `ingest`.

    >>> broken = np.array([[1, 1, 0, 0, 0, 1, -1], [2, 3, 5, 0, 0, 0, 1]])
    >>> report = ff.check({"broken": broken})
    >>> [(record.input, record.line, record.code) for record in report.records]
    [('broken.swc', 2, 'W_ZERO_RADIUS')]
    """
    options = _given(
        unit=(unit, "um"), version=(version, "cng"), strict=(strict, False), one_cell_a_file=(one_cell_a_file, False),
        soma_links=(soma_links, True), population=(population, ""), morphologies=(os.fspath(morphologies), ""),
    )
    options.update(_remote(token, cache, "4GiB", 32), progress=_callable(progress))
    with tempfile.TemporaryDirectory(prefix="filiform-neurons-") as folder:
        result = _core.check(_paths(inputs, folder, unit), options)
    return CheckReport(**_reported(result))


def remove(names: Union[str, Sequence[str]], path: Path, *, memory: Union[int, str] = "1GiB", progress: Progress = None) -> IngestReport:
    """Remove cells of a set on disk, by their names. Indices of the others stay.

    Raises ValueError for an unknown name; the set is then unchanged. `compact` frees the space.

    >>> report = ff.ingest(s, "some.fil")
    >>> ff.remove("L4_1", "some.fil").cells
    2
    """
    listed = [names] if isinstance(names, str) else [str(getattr(name, "name", name)) for name in names]
    if not listed:
        raise ValueError("names: give the name of a cell, or several")
    options = {"remove": [os.fsencode(name) for name in listed], "memory": _bytes("memory", memory), "progress": _callable(progress)}
    return IngestReport(**_reported(_core.ingest([], os.fsencode(path), options)))


def compact(path: Path, *, memory: Union[int, str] = "1GiB", threads: int = 0, progress: Progress = None) -> IngestReport:
    """Rewrite a set that has grown or shrunk as one ingest of its cells would, and free the space of what was removed.

    Cells get new indices if some were removed.

    >>> report = ff.ingest(s, "some.fil")
    >>> report = ff.remove("L4_1", "some.fil")
    >>> ff.compact("some.fil").cells
    2
    """
    options = {"memory": _bytes("memory", memory), "threads": threads, "progress": _callable(progress)}
    return IngestReport(**_core.compact(os.fsencode(path), options))


def verify(
    path: Path, *, deep: bool = False, sha256: str = "", token: str | None = None, cache: Path | None = None, progress: Progress = None
) -> VerifyReport:
    """Check every byte of a set, or with `deep` every invariant of the format too.

    sha256 : compare with what ``filiform info SET --sha256`` prints. Raises OSError for a set that is not there.

    >>> ff.verify("column.fil", deep=True)
    <filiform.VerifyReport: sound, 1 tiles, ... bytes>
    """
    if sha256 and (len(sha256) != 64 or set(sha256.lower()) - set("0123456789abcdef")):
        raise ValueError("sha256: give 64 hexadecimal digits, as 'filiform info SET --sha256' prints them")
    options = {**_remote(token, cache, "4GiB", 32), "progress": _callable(progress)}
    tiles, size, count, problems = _core.verify(os.fsencode(path), deep, sha256, options)
    return VerifyReport(tiles, size, [_decoded(problem) for problem in problems], count)


def synth(path: Path, cells: int = 200, *, seed: int = 1, kind: str = "column", progress: Progress = None) -> int:
    """Write synthetic neurons of a cortical column as an archive of SWC files, to try things with; return the number of samples.

    The same seed gives the same bytes. kind : ``"column"``, or another of ``filiform synth --kind``. A file is replaced
    when all is written. Raises ValueError, OSError.

    >>> ff.synth("column.zip", cells=2)
    8214
    """
    count = operator.index(cells)
    if not 0 < count < 2**32:
        raise ValueError(f"cells: must be 1 or more, and less than 2**32, got {cells}")
    if not 0 <= operator.index(seed) < 2**64:
        raise ValueError(f"seed: must be 0 or more, and less than 2**64, got {seed}")
    return _core.synth(os.fsencode(path), count, operator.index(seed), kind, {"progress": _callable(progress)})


def _given(**options: tuple[Any, Any]) -> dict[str, Any]:
    """The options that differ from their defaults. Tables, whose default is None, are not compared."""
    return {
        name: value for name, (value, default) in options.items()
        if value is not default and (default is None or value != default or isinstance(value, bool))
    }


def _bytes(name: str, value: Union[int, str]) -> int:
    return _core.parse_bytes(name, value) if isinstance(value, str) else int(value)


def _callable(progress: Progress) -> Progress:
    if progress is not None and not callable(progress):
        raise TypeError("progress: expected a function of phase, done and total")
    return progress


def _remote(token: str | None, cache: Path | None, cache_size: Union[int, str], connections: int) -> dict[str, Any]:
    sent = token if token is not None else os.environ.get("FILIFORM_TOKEN", "")
    return {
        "token": sent, "cache": b"" if cache is None else os.fsencode(cache), "cache_size": _bytes("cache_size", cache_size),
        "connections": connections,
    }


def _object_ids(ids: Union[Path, Sequence[int]]) -> list[int]:
    if isinstance(ids, (str, os.PathLike)):
        with open(ids, encoding="utf-8") as file:
            ids = [int(line) for line in file.read().split()]
    return sorted({int(i) for i in ids})


def _is_set(thing: Any) -> bool:
    """True for a `Set`, and for the path or address of one."""
    from .set import Set

    if not isinstance(thing, (str, os.PathLike)):
        return isinstance(thing, Set)
    name = os.fsdecode(thing)
    is_address = "://" in name and (name.rstrip("/").lower().endswith(".fil") or "/v1/sets/" in name)
    return is_address or os.path.isfile(os.path.join(name, "CURRENT"))


@contextlib.contextmanager
def _opened(inputs: Any, token: str | None, cache: Path | None) -> "Iterator[Set]":
    """The set that the cells come from. One that is opened here is closed here."""
    from .set import Set

    if isinstance(inputs, (str, os.PathLike)):
        with Set(os.fsdecode(inputs), token=token, cache=cache) as opened:
            yield opened
        return
    if token is not None or cache is not None:
        raise ValueError("token, cache: are for addresses; inputs is a set that is open")
    yield inputs[0].set if isinstance(inputs, CellList) else inputs


def _ingest_cells(
    owner: "Set", inputs: Any, output: Path, cells: Any, type: Any, where: Any, box: Any, making: dict[str, Any]
) -> IngestReport:
    chosen = owner._indices(inputs) if isinstance(inputs, CellList) else owner._chosen(None)
    if cells is not None:
        wanted = set(owner._indices(cells))
        chosen = [index for index in chosen if index in wanted]
    if where is not None:
        met = set(owner._cells_meeting(where))
        chosen = [index for index in chosen if index in met]
    corners = None
    if box is not None:
        lo, hi = box
        corners = (lo, hi)
    types = "" if type is None else type if isinstance(type, str) else ",".join(map(str, type))
    result = _core.ingest_cells(
        owner._handle, chosen, types, corners, os.fsencode(owner.path), os.fsencode(output), making
    )
    return IngestReport(**result)


def _paths(inputs: Any, folder: str, unit: str) -> list[bytes]:
    """The paths of the inputs. Neurons in memory, in this unit if they state none, go to files of the folder."""
    if isinstance(inputs, (list, tuple, Mapping)) and not inputs:
        raise ValueError("inputs: give at least one file, folder, archive or neuron")
    if isinstance(inputs, Mapping):
        return neurons.write(inputs, folder, unit)
    listed = list(neurons.flat(inputs))
    if not listed:
        raise ValueError("inputs: give at least one file, folder, archive or neuron")
    paths = [thing for thing in listed if isinstance(thing, (str, os.PathLike))]
    in_memory = [thing for thing in listed if not isinstance(thing, (str, os.PathLike))]
    for thing in in_memory:
        if not neurons.is_neuron(thing):
            raise TypeError(f"inputs: expected paths or neurons, got {type(thing).__name__}")
    for path in paths:
        name = os.fsdecode(path)
        if "://" not in name and not os.path.exists(path):
            raise FileNotFoundError(errno.ENOENT, "inputs: no such file or folder", name)
    return [os.fsencode(path) for path in paths] + neurons.write(neurons.named(in_memory), folder, unit)


def _reported(result: dict[str, Any]) -> dict[str, Any]:
    for lost in "refused", "skipped":
        result[lost] = [(_decoded(name), _decoded(reason)) for name, reason in result[lost]]
    result["files"] = [CheckedInput(_decoded(name), fate, _decoded(reason), *counts) for name, fate, reason, *counts in result["files"]]
    result["records"] = Records(*result["records"])
    result["summary"] = _decoded(result["summary"])
    result["note"] = _decoded(result["note"])
    return result


def _decoded(raw: bytes) -> str:
    return raw.decode("utf-8", "surrogateescape")


def _add_table(options: dict[str, Any], name: str, table: Any, key: str | None) -> None:
    if table is None:
        if key is not None:
            raise ValueError("attributes, key: go together: the table, and its column with the names of cells")
        return
    if isinstance(table, (str, os.PathLike)):
        options[name] = os.fsencode(table)
    elif name == "placements":
        options["placements_text"] = _table(table)
    else:
        options["attributes_text"] = _attribute_table(table)
    if key is not None:
        options["key"] = os.fsencode(key)


def _attribute_table(table: Any) -> bytes:
    """The table of attributes as tab-separated text."""
    names = getattr(table, "columns", None)
    if names is None:
        dtype = getattr(table, "dtype", None)
        names = dtype.names if dtype is not None else list(table)
    if names is None:
        raise ValueError("attributes: expected a path, or a table with columns")
    columns = [[_field(str(name), value) for value in table[name]] for name in names]
    rows = zip(*columns)
    return ("\n".join("\t".join(row) for row in [[_field("a column", name) for name in names], *rows]) + "\n").encode("utf-8", "surrogateescape")


def _field(column: str, value: Any) -> str:
    if value is None or type(value).__name__ in ("NAType", "NaTType") or (isinstance(value, (float, np.floating)) and value != value):
        return ""
    text = repr(float(value)) if isinstance(value, (float, np.floating)) else _decoded(value) if isinstance(value, bytes) else str(value)
    if "\t" in text or "\n" in text or "\r" in text:
        raise ValueError(f"attributes: {column}: {text[:40]!r} must not hold tabs or line ends")
    return text


def _table(placements: Any) -> bytes:
    """The table of placements as tab-separated text."""
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
