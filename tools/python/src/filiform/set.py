"""Set: a tile set, opened for questions."""

from __future__ import annotations

import errno
import importlib.util
import io
import json
import operator
import os
from types import TracebackType
from typing import TYPE_CHECKING, Any, Iterable, Iterator, Literal, Sequence, Union, overload

import numpy as np
import numpy.typing as npt

from . import _core
from . import fields as _fields
from .arrays import Array, Floats, Picture, Rows
from .cells import NO_CELL, CellList, Cells
from .fields import Fields
from .navigation import Navigation
from .pictures import notebook_png, render
from .results import Density, GroupedDensity, LevelSegments
from .view import View
from .scene import Owner, Progress

if TYPE_CHECKING:
    import pandas

Words = Union[str, Sequence[str], None]


def open(
    path: Union[str, "os.PathLike[str]"],
    *,
    token: str | None = None,
    cache: Union[str, "os.PathLike[str]", None] = None,
    budget: Union[int, str] = "256MiB",
    revision: str | None = None,
) -> Set:
    """Open a tile set: a folder, or the address of a set on a server.

    Parameters
    ----------
    path : a folder such as ``"column.fil"``, ``"http://HOST/v1/sets/NAME"``, ``"https://HOST/PATH/NAME.fil"``
        or ``"s3://BUCKET/PATH/NAME.fil"``.
    token : sent to the set's own host only. Default: the variable ``FILIFORM_TOKEN``.
    cache : a folder that keeps what is read from an address, for later processes. Default: nothing is kept.
    budget : bytes of tiles to keep in memory between questions, a number or text such as ``"1GiB"``.
    revision : open this revision, such as `Set.revision` gave it, instead of the newest.

    Raises FileNotFoundError if there is no such folder, OSError if it cannot be read or is no set, CorruptSet if it is
    damaged, ValueError for a malformed address. Reads a few kilobytes, whatever the size of the set.

    >>> with ff.open("column.fil", budget="1GiB") as opened:
    ...     len(opened.cells)
    3
    """
    return Set(path, token=token, cache=cache, budget=budget, revision=revision)


class Set:
    """A tile set. Make it with `filiform.open`; use it as a context manager, or call `close`.

    Any number of threads may use one Set. It pickles as its path and revision, so that processes of multiprocessing and
    dask open the same revision; a forked process does so by itself. Where that revision was replaced, they raise OSError.
    Sets are equal if path and revision are. A pickle holds neither token nor cache: other processes take the token from
    the variable ``FILIFORM_TOKEN``.
    """

    def __init__(
        self,
        path: Union[str, "os.PathLike[str]"],
        *,
        token: str | None = None,
        cache: Union[str, "os.PathLike[str]", None] = None,
        budget: Union[int, str] = "256MiB",
        revision: str | None = None,
    ) -> None:
        name = os.fspath(path)
        if not isinstance(name, str):
            raise TypeError(f"path: expected text, got {type(name).__name__}")
        if not _core.is_address(name):
            if not os.path.isdir(name):
                if os.path.exists(name):
                    raise NotADirectoryError(errno.ENOTDIR, "a file, not a tile set; make one from it with filiform.ingest", name)
                raise FileNotFoundError(errno.ENOENT, "no such tile set (a folder)", name)
            name = os.path.abspath(name)
        self._budget = _core.parse_bytes("budget", budget) if isinstance(budget, str) else int(budget)
        if self._budget < 0:
            raise ValueError("budget: must be 0 bytes or more")
        self._path = name
        self._cells: Cells | None = None
        sent = token if token is not None else os.environ.get("FILIFORM_TOKEN", "")
        self._handle = _core.SetHandle(
            name, revision or "", sent if _core.is_address(name) else "", "" if cache is None else os.fspath(cache), self._budget
        )

    # -- the set itself

    @property
    def path(self) -> str:
        """Absolute path of the folder, or the address.

        >>> os.path.basename(s.path)
        'column.fil'
        """
        return self._path

    @property
    def closed(self) -> bool:
        """True after `close`.

        >>> s.closed
        False
        """
        return self._handle.closed

    @property
    def revision(self) -> str:
        """The revision that was opened. It stays, if another one is published meanwhile, also in other processes.

        >>> ff.open("column.fil", revision=s.revision) == s
        True
        """
        return self._handle.revision

    @property
    def units(self) -> str:
        """The unit of positions and lengths, as pint and navis write it: ``"1 micrometer"``.

        >>> s.units
        '1 micrometer'
        """
        return "1 micrometer"

    @property
    def bounds(self) -> Floats:
        """Lowest and highest corner of all samples: shape (2, 3), um; NaN for a set without samples.

        >>> s.bounds
        array([[  0., -10.,   0.],
               [120.,  60., 100.]])
        """
        bounds = self._handle.bounds()
        return np.full((2, 3), np.nan) if bounds is None else bounds

    def info(self) -> dict[str, Any]:
        """All totals of the set: what ``filiform info SET --json`` prints.

        >>> s.info()["cells"]
        3
        """
        info: dict[str, Any] = json.loads(self._handle.info())
        return info

    @property
    def resident_bytes(self) -> int:
        """Bytes of the tiles in memory now; at most about the budget.

        >>> hits = s.nearest([0, 0, 0])
        >>> s.resident_bytes > 0
        True
        """
        return self._handle.resident_bytes()

    @property
    def cells(self) -> Cells:
        """The cells, by name: ``s.cells["name"]``, ``s.cells.find("L5*")``, ``len(s.cells)``.

        >>> s.cells["L5_1"]
        <filiform.Cell 'L5_1': 4 segments>
        """
        if self._cells is None:
            self._cells = Cells(self)
        return self._cells

    def close(self) -> None:
        """Close the files. Calls under way in other threads end first. Later calls raise ValueError.

        >>> other = ff.open("column.fil")
        >>> other.close()
        >>> other
        <filiform.Set '...column.fil', closed>
        """
        self._handle.close()

    def __enter__(self) -> Set:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __reduce__(self) -> tuple[Any, ...]:
        if self.closed:
            raise ValueError(f"the set {self._path} is closed; open it again")
        return _reopen, (self._path, self.revision, self._budget)

    def __copy__(self) -> Set:
        return self

    def __deepcopy__(self, memo: Any) -> Set:
        return self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Set) and (self is other or (*self._id, self.closed) == (*other._id, other.closed))

    def __hash__(self) -> int:
        return hash(self._id)

    def __dask_tokenize__(self) -> tuple[str, ...]:
        return ("filiform.Set", *self._id)

    @property
    def _id(self) -> tuple[str, str]:
        """Path and revision: what names the same cells in each process."""
        return self._path, self.revision

    def __repr__(self) -> str:
        if self.closed:
            return f"<filiform.Set {self._path!r}, closed>"
        cells, _, segments, _ = self._handle.counts()
        return f"<filiform.Set {self._path!r}: {cells} cells, {segments} segments>"

    def _repr_png_(self) -> bytes | None:
        return notebook_png(self)

    def _index_of(self, cell: Any) -> int:
        return self.cells.index(cell)

    def _indices(self, cells: Any) -> list[int]:
        """The indices of a cell or of a sequence of cells, each once."""
        if isinstance(cells, str) or not isinstance(cells, Iterable):
            return [self._index_of(cells)]
        return list(dict.fromkeys(self._index_of(cell) for cell in cells))

    def _filter(self, cell: Any, not_cell: Any, type: Any, where: Any) -> tuple[Any, ...]:
        return (
            None if cell is None else sorted(self._indices(cell)),
            [] if not_cell is None else self._indices(not_cell),
            _listed(type),
            [] if where is None else [where] if isinstance(where, str) else list(where),
        )

    def _scene(self) -> tuple[Owner, int | None, Floats | None]:
        return self, None, None

    # -- attributes of cells

    @property
    def attributes(self) -> list[str]:
        """The names of the attributes that the set has of its cells, such as ``mtype`` and ``layer``.

        >>> s.attributes
        ['layer', 'mtype']
        """
        return [name.decode("utf-8", "surrogateescape") for name in _core.attribute_names(self._handle)]

    def attribute(self, name: str, cells: npt.ArrayLike | None = None) -> Array:
        """One attribute of all cells, by cell index: float64 with nan, or objects (text) with None, where it is missing.

        Objects are text, or integers of which a float64 does not hold all, such as ids beyond 2**53.

        ``s.attribute("layer", hits["cell"])`` gives it for each row of `nearest`; it is missing where no segment was
        found. Raises KeyError for an unknown one.

        >>> s.attribute("layer")
        array([4., 5., 5.])
        >>> s.attribute("mtype", s.nearest([[0, 40, 0]])["cell"])
        array(['TPC'], dtype=object)
        """
        column = self._column(name)
        if cells is None:
            return column
        indices = np.asarray(cells)
        absent = indices == NO_CELL
        missing = np.nan if column.dtype.kind == "f" else None
        chosen: Array = np.full(indices.shape, missing, column.dtype)
        chosen[~absent] = column[indices[~absent]]
        return chosen

    def _column(self, name: str) -> Array:
        column = _core.attribute_column(self._handle, name.encode("utf-8", "surrogateescape"))
        if column is None:
            raise KeyError(f"no attribute {name!r} in {self._path}; it has {', '.join(self.attributes) or 'none'}")
        values, texts = column
        if texts is None:
            return values
        if not isinstance(texts, list):  # which cells have one of the integers
            integers = values.astype(object)
            integers[~texts] = None
            return integers
        named = np.array([*(text.decode("utf-8", "surrogateescape") for text in texts), None], dtype=object)
        column_of_text: Array = named[np.minimum(values, len(texts))]
        return column_of_text

    def _cells_meeting(self, where: Union[str, Sequence[str]]) -> list[int]:
        return _core.cells_meeting(self._handle, [where] if isinstance(where, str) else list(where))

    def where(self, *texts: str, **conditions: Any) -> CellList:
        """The cells whose attributes meet all conditions, by ascending index.

        A condition is a value, a list of values, or a function that takes the whole column and returns a mask:
        ``s.where(mtype=["L5_TPC:A", "L5_TPC:B"], layer=5)``, ``s.where(depth=lambda d: d > 800)``. Texts are conditions
        as in ``filiform cells --where``: ``s.where("layer>=5", "measure:length>5000")``.
        Raises KeyError for an unknown attribute.

        >>> [cell.name for cell in s.where(layer=5)]
        ['L5_1', 'L5_2']
        >>> len(s.where(layer=lambda layer: layer < 5)), len(s.where("mtype=T*", "measure:length>20"))
        (1, 2)
        """
        mask = np.zeros(self._handle.cell_limit(), bool)
        mask[self._cells_meeting(texts) if texts else self._chosen(None)] = True
        for name, condition in conditions.items():
            column = self.attribute(name)
            if callable(condition):
                met = np.asarray(condition(column))
                if met.shape != mask.shape or met.dtype != bool:
                    raise ValueError(f"{name}: the function must return one bool a cell, shape {mask.shape}")
            else:
                values = list(condition) if isinstance(condition, (list, tuple, set, frozenset, np.ndarray)) else [condition]
                met = np.zeros(mask.shape, bool)
                for value in values:
                    met |= np.asarray(column == value, bool)
            mask &= met
        return self.cells.where(np.flatnonzero(mask))

    @overload
    def measure(
        self, cells: Any = None, *, frame: Literal[False], per: str = "cell", features: Words = None, type: Words = None,
        sholl: float | None = None, workers: int = -1,
    ) -> dict[str, Array]: ...

    @overload
    def measure(
        self, cells: Any = None, *, frame: Literal[True], per: str = "cell", features: Words = None, type: Words = None,
        sholl: float | None = None, workers: int = -1,
    ) -> "pandas.DataFrame": ...

    @overload
    def measure(
        self, cells: Any = None, *, frame: bool | None = None, per: str = "cell", features: Words = None, type: Words = None,
        sholl: float | None = None, workers: int = -1,
    ) -> Any: ...

    def measure(
        self,
        cells: Any = None,
        *,
        per: str = "cell",
        features: Words = None,
        type: Words = None,
        sholl: float | None = None,
        workers: int = -1,
        frame: bool | None = None,
    ) -> Any:
        """Measure the shapes of cells: neurites, branches, tips, lengths, areas, volumes, angles, Sholl.

        Parameters
        ----------
        cells : a name or Cell, or a sequence of them, each measured once. Default: all cells.
        per : one row for each ``"cell"``, ``"neurite"``, ``"branch"`` or ``"type"``, or one for the ``"set"``.
        features : names with commas between, or a list; ``"all"``. Default: the most usual.
            ``index/measure/MEASURES.md`` defines them; they are those of ``filiform measure``.
        type : measure only neurites of these types: ``"axon"``, ``"basal"``, ``"apical"`` or codes of SWC.
        sholl : um; count crossings with spheres about the soma, every so far from its surface on. Adds the tables
            ``sholl`` and ``sholl_by_ends``, one row a cell, 0 beyond its last sphere.
        workers : threads; -1 is one a processor. All numbers give the same values.
        frame : True: a pandas DataFrame; False: a dict of arrays. Default: a DataFrame if pandas is installed.

        The columns have units in their names, such as ``length_um``; nan where there is no value. Raises ValueError
        for an unknown word, with near names, and KeyError for an unknown cell.

        >>> s.measure("L4_1", features="length,tips", sholl=10, frame=False)["length_um"]
        array([30.])
        """
        chosen = self._chosen(cells)
        if sholl is not None and not 0 < sholl < np.inf:
            raise ValueError("sholl: must be a finite number above 0 um")
        columns = {
            title: np.load(io.BytesIO(npy))
            for title, npy in _core.measures(
                self._handle, chosen, per, _listed(features), _listed(type), sholl or 0.0, workers
            )
        }
        return _framed(columns, frame)

    @overload
    def contacts(
        self, within: float, *, frame: Literal[False], from_: Any = None, to: Any = None, types: Words = None, surface: bool = False,
        workers: int = -1,
    ) -> dict[str, Array]: ...

    @overload
    def contacts(
        self, within: float, *, frame: Literal[True], from_: Any = None, to: Any = None, types: Words = None, surface: bool = False,
        workers: int = -1,
    ) -> "pandas.DataFrame": ...

    @overload
    def contacts(
        self, within: float, *, frame: bool | None = None, from_: Any = None, to: Any = None, types: Words = None, surface: bool = False,
        workers: int = -1,
    ) -> Any: ...

    def contacts(
        self,
        within: float,
        *,
        from_: Any = None,
        to: Any = None,
        types: Words = None,
        surface: bool = False,
        workers: int = -1,
        frame: bool | None = None,
    ) -> Any:
        """Find where segments of different cells lie within a distance: the rows of ``filiform contacts``.

        Parameters
        ----------
        within : um; what is at this distance is within it.
        from_, to : the cells of the first and of the second side: a name or Cell, or a sequence of them, such as
            ``s.where(layer=4)``. Default: all cells.
        types : ``"axon,dendrite"``: only segments of these types, of the first and of the second cell; ``+`` joins
            several of one side.
        surface : measure between surfaces, not axes; an unknown radius counts 0.
        workers : threads; -1 is one a processor. All numbers give the same rows.
        frame : True: a pandas DataFrame; False: a dict of arrays. Default: a DataFrame if pandas is installed.

        A row is a contact site: pairs of segments that are next to each other on both cells. ``from`` and ``to`` are
        indices of cells, for `Set.attribute` and ``s.cells.at``; ``from_name`` and ``to_name`` their names; ``_type``
        is a code of SWC; a missing ``_path_um`` is nan. Counts between layers:
        ``pandas.crosstab(s.attribute("layer", c["from"]), s.attribute("layer", c["to"]))``.
        Raises ValueError for an unknown type, with near names, and for a distance that is not above 0, or at which
        every segment would touch every other; KeyError for an unknown cell.

        >>> s.contacts(101, frame=False)["from_name"]
        array(['L4_1', 'L5_1'], dtype=object)
        """
        columns = {
            title: np.load(io.BytesIO(npy))
            for title, npy in _core.contacts(
                self._handle, within, sorted(self._chosen(from_)), sorted(self._chosen(to)), _listed(types), surface, workers
            )
        }
        names = columns.pop("cells").astype(object)
        for side in ("from", "to"):
            columns[f"{side}_name"] = names[columns[side]]
        return _framed(columns, frame)

    def _chosen(self, cells: Any) -> list[int]:
        """Indices of cells, each once; None: all."""
        return [index for index, _ in self._handle.cells_named(b"")] if cells is None else self._indices(cells)

    @overload
    def density(
        self, step: float, *, cells: Any = None, type: Words = None, group_by: None = None,
        workers: int = -1,
    ) -> Density: ...

    @overload
    def density(
        self, step: float, *, cells: Any = None, type: Words = None,
        group_by: Union[str, Sequence[str]], workers: int = -1,
    ) -> GroupedDensity: ...

    def density(
        self,
        step: float,
        *,
        cells: Any = None,
        type: Words = None,
        group_by: Words = None,
        workers: int = -1,
    ) -> Union[Density, GroupedDensity]:
        """The length of neurite in each box of a grid.

        Parameters
        ----------
        step : um, the edge of the boxes. The planes of the grid lie at multiples of it, about the boxes of the cells.
        cells : a name or Cell, or a sequence of them, such as ``s.where(layer=5)``. Default: all cells.
        type : count only segments of these types: ``"axon"``, ``"basal"``, ``"apical"`` or codes of SWC.
        group_by : ``"cell"``, ``"type"`` or both, ``"cell,type"``: one row for each box and group with neurite.
        workers : threads; -1 is one a processor. All numbers give the same values.

        Returns a `Density`, or with `group_by` a `GroupedDensity`. ``density.sum() * step**3`` is the length of the
        neurites, as `measure` sums it. Raises ValueError for a grid of more than 2**25 boxes, with their number, and
        for more groups.

        >>> s.density(50)
        <filiform.Density: 3 x 3 x 3 boxes of 50 um, 86.6 um of neurite>
        >>> s.density(50, group_by="cell,type").rows[0]
        (0, 0, 0, 1, 3, 14.14213562)
        """
        try:
            step = float(step)
        except (TypeError, ValueError):
            raise TypeError(f"step: expected a number, got {_kind(step)}") from None
        chosen = None if cells is None else self._indices(cells)
        groups = () if group_by is None else tuple(_listed(group_by).split(","))
        for group in groups:
            if group not in ("cell", "type"):
                raise ValueError(f"group_by: expected 'cell', 'type' or 'cell,type', got {group!r}")
        lengths, rows, origin = _core.density(self._handle, step, chosen, _listed(type), workers, "cell" in groups, "type" in groups)
        if groups:
            x, y, z = lengths.shape
            return GroupedDensity(rows, np.array(origin), step, (x, y, z))
        return Density(lengths / step**3, np.array(origin), step)

    # -- all segments

    @overload
    def segments(
        self, fields: Fields = None, *, box: Any = None, cells: Any = None, type: Words = None,
        chunks: None = None, workers: int = 1,
    ) -> Array: ...

    @overload
    def segments(
        self, fields: Fields = None, *, box: Any = None, cells: Any = None, type: Words = None,
        chunks: int, workers: int = 1,
    ) -> Iterator[Array]: ...

    def segments(
        self,
        fields: Fields = None,
        *,
        box: Any = None,
        cells: Any = None,
        type: Words = None,
        chunks: int | None = None,
        workers: int = 1,
    ) -> Union[Array, Iterator[Array]]:
        """All segments, or those of a box, of cells or of types, in one pass that decodes each tile once.

        Parameters
        ----------
        fields : names with commas between, or a list; the name of one field gives its values. ``cell segment`` uint32;
            ``sample`` int64, the id in the file of the end away from the root; ``type`` int32 and ``radius`` float32 um
            of that end; ``x0 y0 z0`` and ``x1 y1 z1`` float64 um, the ends away from and towards the root; ``length``
            float64 um. Default: all but ``length``. Fewer fields take less time.
        box : (2, 3), um: only segments that meet this closed box.
        cells : a name or Cell, or a sequence of them, such as ``s.where(layer=5)``. Default: all cells.
        type : only segments of these types: ``"axon"``, ``"basal"``, ``"apical"``, ``"dendrite"``, ``"soma"``,
            ``"undefined"`` or codes of SWC.
        chunks : rows an array: gives arrays one after the other, so that memory stays bounded. Default: one array.
        workers : threads that decode tiles; -1 is one a processor. All numbers give the same rows.

        Each segment comes once, in the order of the tiles: neighbours in space are near each other. An isolated sample
        is a segment with equal ends. Raises ValueError, KeyError for an unknown cell, OSError, CorruptSet.

        >>> s.segments("cell,type,length", cells="L5_1", type="axon")
        array([(1, 2, 40.)], dtype=[('cell', '<u4'), ('type', '<i4'), ('length', '<f8')])
        >>> s.segments("length").sum().round(2)
        216.57
        >>> for rows in s.segments(chunks=4):
        ...     print(len(rows))
        4
        4
        2
        """
        row = _fields.of_segments(fields)
        corners = None if box is None else _corners(box)
        reader = _core.SegmentReader(
            self._handle, row, corners, None if cells is None else sorted(self._indices(cells)), _listed(type), workers
        )
        single = (row.names or ("",))[0] if _fields.is_single(fields) else None
        if chunks is not None:
            try:
                chunks = operator.index(chunks)
            except TypeError:
                raise TypeError(f"chunks: expected an integer, got {_kind(chunks)}") from None
            if chunks < 1:
                raise ValueError("chunks: must be 1 row or more")
            return _parts(reader, min(chunks, 2**62), single)
        if box is None and cells is None and type is None:  # one array: its size is known
            rows = reader.next(2**62)
            return rows if single is None else rows[single]
        parts = list(_parts(reader, 2**17, single))
        if len(parts) == 1:
            return parts[0]
        return np.concatenate(parts) if parts else np.empty(0, row if single is None else row[single])

    # -- questions

    @overload  # type: ignore
    def nearest(
        self, points: Sequence[float], k: Literal[1] = 1, eps: float = 0.0, distance_upper_bound: float = np.inf, workers: int = 1, *,
        approximate: bool = False, cell: Any = None, not_cell: Any = None, type: Words = None, where: Words = None, own: bool = True,
        of_cells: bool = False,
    ) -> np.void: ...

    @overload
    def nearest(
        self, points: npt.ArrayLike, k: Union[int, Sequence[int]] = 1, eps: float = 0.0, distance_upper_bound: float = np.inf,
        workers: int = 1, *, approximate: bool = False, cell: Any = None, not_cell: Any = None, type: Words = None, where: Words = None, own: bool = True,
        of_cells: bool = False,
    ) -> Rows: ...

    def nearest(
        self,
        points: npt.ArrayLike,
        k: Union[int, Sequence[int]] = 1,
        eps: float = 0.0,
        distance_upper_bound: float = np.inf,
        workers: int = 1,
        *,
        approximate: bool = False,
        cell: Any = None,
        not_cell: Any = None,
        type: Words = None,
        where: Words = None,
        own: bool = True,
        of_cells: bool = False,
    ) -> Union[Rows, np.void]:
        """Find the nearest segments, exactly. Names and meanings are those of ``scipy.spatial.cKDTree.query``.

        Parameters
        ----------
        points : shape (3,) or (..., 3), um. A float64 array in C order is not copied.
        k : how many segments a point, or a sequence of ranks, which begin at 1.
        eps : distances may be up to (1 + eps) times too long; then ``exact`` is False.
        distance_upper_bound : um; only nearer segments are found.
        workers : threads for many points; -1 is one a processor.
        approximate : use the set's landmarks only, read no tile.
        cell, not_cell : a name or Cell, or a sequence of them, such as ``s.where(layer=5)``; find segments of
            these cells only, or of no such cell.
        type : find only segments of these types: ``"axon"``, ``"basal"``, ``"apical"``, ``"dendrite"``, ``"soma"``,
            ``"undefined"`` or codes of SWC.
        where : conditions such as ``"layer>=5"`` or ``"measure:length>5000"``, as in ``filiform cells --where``; all must
            hold.
        own : False: find no segments of a point's own cell, the one with the segment nearest to the point of all
            segments of the set, whatever the filters; of equally near ones, that of the lowest cell.
        of_cells : find cells, each by its nearest segment; k counts cells.

        Returns
        -------
        A structured array of shape points.shape[:-1], with an axis of k at the end unless k is 1. For one point and
        k = 1: one row, ``numpy.void``; a checker of types knows so if the point is no array. Fields: ``distance x y z`` float64 um, the nearest place; ``cell`` uint32, for ``s.cells[i]``;
        ``segment`` uint32, the row of `Cell.ends`; ``sample`` int64, the id in the file of the segment's end away from the root; ``exact``
        bool; ``type`` int32, the segment's code of SWC; ``radius`` float64 um at the nearest place, nan if unknown;
        ``t`` float64, the place along the segment, from 0 at ``sample`` to 1 at its parent. Where fewer than k segments
        are found, distance is inf, x y z radius t are nan, sample and type are -1, cell and segment are 2**32 - 1.
        `approximate` reads neither type nor radius.

        Raises ValueError, TypeError, OSError, CorruptSet, and MemoryError for a result larger than the memory.

        >>> hit = s.nearest([15, 0, 2])
        >>> hit["distance"], s.cells[hit["cell"]].name
        (4.06..., 'L5_1')
        >>> s.nearest([[0, 40, 1], [100, 40, 1]], type="axon")["distance"]
        array([1., 1.])
        """
        return _core.nearest(self._handle, points, k, eps, distance_upper_bound, workers, approximate, self._filter(cell, not_cell, type, where), own, of_cells)

    @overload  # type: ignore
    def snap(self, points: Sequence[float], workers: int = 1) -> tuple[Floats, np.float64]: ...

    @overload
    def snap(self, points: npt.ArrayLike, workers: int = 1) -> tuple[Floats, Floats]: ...

    def snap(self, points: npt.ArrayLike, workers: int = 1) -> tuple[Floats, Union[Floats, np.float64]]:
        """Move points onto the nearest neurite.

        points has the shape (3,) or (..., 3), um. Returns the moved points, of the same shape, and the distances, of
        shape points.shape[:-1], um. `Cell.snap` moves points to the samples of one cell, as navis does.

        >>> moved, distances = s.snap([[0, 20, 3]])
        >>> moved, distances
        (array([[ 0., 20.,  0.]]), array([3.]))
        """
        hits = self.nearest(points, workers=workers)
        moved = np.stack([hits["x"], hits["y"], hits["z"]], axis=-1)
        return moved, hits["distance"].copy()

    def box_query(
        self,
        corner: npt.ArrayLike,
        opposing_corner: npt.ArrayLike,
        *,
        fields: Fields = None,
        cell: Any = None,
        not_cell: Any = None,
        type: Words = None,
        where: Words = None,
    ) -> Array:
        """Find all segments that meet a closed box, exactly.

        The corners have the shape (3,), um, and are rounded to the set's grid (2 nm by default). Returns rows as
        `nearest` does, nearest to the middle of the box first. `fields` chooses fields, as in brain-indexer: a list
        gives an array of these fields, one name gives its values. It may also name ``x0 y0 z0 x1 y1 z1``, the ends of
        the segment, away from and towards the root, um. The filters are those of `nearest`.

        >>> s.box_query([-1, 30, -1], [1, 50, 1], fields="sample")
        array([5])
        """
        ends = _fields.wants_ends(fields)
        return _fields.select(*_core.box_query(self._handle, corner, opposing_corner, ends, self._filter(cell, not_cell, type, where)), fields)

    def sphere_query(
        self,
        center: npt.ArrayLike,
        radius: float,
        *,
        fields: Fields = None,
        cell: Any = None,
        not_cell: Any = None,
        type: Words = None,
        where: Words = None,
    ) -> Array:
        """Find all segments within a closed sphere, exactly; nearest to the center first.

        center has the shape (3,), radius is in um. Rows, `fields` and filters are as for `box_query`.

        >>> s.sphere_query([0, 40, 0], 10, fields=["sample", "distance"])
        array([(5, 0.)], dtype=[('sample', '<i8'), ('distance', '<f8')])
        """
        return _fields.select(*_core.sphere_query(self._handle, center, radius, _fields.wants_ends(fields), self._filter(cell, not_cell, type, where)), fields)

    @overload
    def box_counts(
        self, corner: npt.ArrayLike, opposing_corner: npt.ArrayLike, *, group_by: None = None, once: bool = False, cell: Any = None, not_cell: Any = None,
        type: Words = None, where: Words = None,
    ) -> int: ...

    @overload
    def box_counts(
        self, corner: npt.ArrayLike, opposing_corner: npt.ArrayLike, *, group_by: Literal["cell"], once: bool = False, cell: Any = None, not_cell: Any = None,
        type: Words = None, where: Words = None,
    ) -> dict[int, int]: ...

    def box_counts(
        self,
        corner: npt.ArrayLike,
        opposing_corner: npt.ArrayLike,
        *,
        group_by: str | None = None,
        once: bool = False,
        cell: Any = None,
        not_cell: Any = None,
        type: Words = None,
        where: Words = None,
    ) -> Union[int, dict[int, int]]:
        """Count the segments that meet a closed box. With ``group_by="cell"``: a dict of cell indices and counts.

        once : True: count a segment only in the box that holds its middle, without the upper faces; so boxes side by
            side count each segment once. The filters are those of `nearest`.

        >>> s.box_counts([0, 0, 0], [50, 50, 50])
        4
        >>> s.box_counts([0, 0, 0], [200, 50, 200], group_by="cell", once=True)
        {0: 2, 1: 3, 2: 3}
        """
        return _grouped(_core.box_counts(self._handle, corner, opposing_corner, self._filter(cell, not_cell, type, where), once), group_by)

    @overload
    def sphere_counts(
        self, center: npt.ArrayLike, radius: float, *, group_by: None = None, cell: Any = None, not_cell: Any = None,
        type: Words = None, where: Words = None,
    ) -> int: ...

    @overload
    def sphere_counts(
        self, center: npt.ArrayLike, radius: float, *, group_by: Literal["cell"], cell: Any = None, not_cell: Any = None,
        type: Words = None, where: Words = None,
    ) -> dict[int, int]: ...

    def sphere_counts(
        self,
        center: npt.ArrayLike,
        radius: float,
        *,
        group_by: str | None = None,
        cell: Any = None,
        not_cell: Any = None,
        type: Words = None,
        where: Words = None,
    ) -> Union[int, dict[int, int]]:
        """Count the segments within a closed sphere. With ``group_by="cell"``: a dict of cell indices and counts.

        The filters are those of `nearest`.

        >>> s.sphere_counts([0, 0, 0], 15, group_by="cell")
        {1: 4}
        """
        return _grouped(_core.sphere_counts(self._handle, center, radius, self._filter(cell, not_cell, type, where)), group_by)

    def ray(
        self,
        origin: npt.ArrayLike,
        direction: npt.ArrayLike,
        *,
        radius: float = 1.0,
        slope: float = 0.0,
        length: float = np.inf,
        k: int | None = None,
        cell: Any = None,
        not_cell: Any = None,
        type: Words = None,
        where: Words = None,
        of_cells: bool = False,
    ) -> Rows:
        """Find the segments near a ray, the first along it first.

        origin and direction have the shape (3,). A segment is found if its distance to the ray is at most
        radius + slope * (distance along the ray), um. `length` ends the ray, `k` limits the rows. The filters and
        `of_cells` are those of `nearest`. Returns a structured array with the fields ``along distance x y z`` (float64
        um), ``cell segment`` (uint32), ``sample`` (int64), and ``type radius t`` as `nearest` has them.

        >>> s.ray([0, 20, -50], [0, 0, 1])["along"]
        array([ 50., 150.])
        """
        return _core.ray(
            self._handle, origin, direction, radius, slope, length, k, self._filter(cell, not_cell, type, where), of_cells
        )

    def levels(self, box: npt.ArrayLike, pixels: float, *, segments: int = 2_000_000) -> LevelSegments:
        """Simplified neurites that draw a box with an error below a pixel.

        box has the shape (2, 3), um; its longest side is drawn `pixels` wide. `segments` limits the choice of tiles.
        Returns `LevelSegments`. Raises ValueError for a set without levels of detail.

        >>> s.levels(s.bounds, pixels=1000)
        <filiform.LevelSegments: ... segments, error ... um, ... hidden>
        """
        return LevelSegments(*_core.levels(self._handle, box, pixels, segments))

    def navigate(
        self,
        cell: Any = None,
        route: str = "longest",
        *,
        method: str = "climb",
        hand: str = "medium",
        seed: int = 1,
        seconds: float | None = None,
        zoom: float = 300.0,
        leap: float = 1.0,
        rate: float = 1000.0,
        speed: float | None = None,
        stiffness: float | None = None,
        budget: Union[int, str, None] = None,
        device: str | None = None,
        record: Union[str, "os.PathLike[str]"] = "",
    ) -> Navigation:
        """Let a simulated hand travel a route, in virtual time. The result depends only on set, arguments and seed.

        Parameters
        ----------
        cell : a name or Cell. Default: the cell with the most segments.
        route : ``"FIRST:LAST"`` (sample ids), ``"longest"``, ``"random:SEED"`` or ``"tour:SEED"``.
        method : ``"climb"``, or a method of the paper: basic, shading, force, force-listing.
        hand : ``"loose"``, ``"medium"`` or ``"firm"``. `device` replaces it, for example ``"replay:FILE"``.
        seconds : limit of simulated time. rate : ticks a second. zoom : um across 0.12 m of device.
        leap : 0 to 1, the part of its range that climb goes up in a tick: 0 follows the neurite, 1 needs the least force.
        speed : of the hand's aim, m/s. stiffness : of the spring to the proxy, N/m. budget : bytes for tiles.
        record : write the exchanges with the device to this file, for ``device="replay:FILE"``. A replay takes the
            options of the recording, but those that differ from the defaults here.

        >>> s.navigate("L5_1", route="5:3")
        <filiform.Navigation on 'L5_1': completed, ... um in ... ticks, at most ... N>
        """
        index = None if cell is None else self.cells.index(cell)
        if isinstance(budget, str):
            budget = _core.parse_bytes("budget", budget)
        name = device if device is not None else f"sim:{hand}"
        ticks, summary = _core.navigate(
            self._handle, index, route, method, name, seed, seconds, zoom, leap, rate, speed, stiffness, budget,
            os.fspath(record),
        )
        return Navigation(ticks, summary)

    def export(
        self,
        path: Union[str, "os.PathLike[str]"],
        cells: Any = None,
        *,
        type: Words = None,
        format: str = "",
        progress: Progress = None,
    ) -> int:
        """Write cells in other formats, as ``filiform export`` does; return the number of samples.

        Parameters
        ----------
        path : the ending chooses: ``.swc``, ``.edges`` (keeps loops), ``.obj`` or ``.vtk`` for one cell; ``"DIR/"``,
            ``"ARCHIVE.zip"`` or ``"DIR.precomputed"`` (Neuroglancer) for several.
        cells : a name or Cell, or a sequence of them. Default: all cells.
        type : only samples of these types; a sample whose parent is left out becomes a root.
        format : of the files of a folder or archive: ``"swc"``, ``"edges"``, ``"obj"``, ``"vtk"``; ``"precomputed"``:
            skeletons in few files. Default: SWC, edges for a cell with loops.

        A file is replaced when all is written; a folder must be empty. Raises ValueError, KeyError, OSError.

        >>> s.export("cells.zip")
        13
        >>> s.export("L5_1_axon.swc", "L5_1", type="axon")
        1
        """
        chosen = self._chosen(cells)
        return _core.export(self._handle, chosen, _listed(type), os.fsencode(path), format, {"progress": progress})

    def view(self, *, page: str | None = None, height: int = 600) -> View:
        """A view for a notebook: the travelling page of a server in a frame, or a picture with a link to it.

        page : address of a server's page; for a set at the address of a server, its own. Without one, the picture alone.
            The frame needs a server that lets the notebook's page hold it, as ``filiform serve --frame-origin URL`` does;
            otherwise the picture links to the page. The page for travel also needs a notebook that is isolated from other
            pages (README, "A set in a notebook"): browsers give threads to no other page in a frame.

        >>> s.view()
        <filiform.View of 'column.fil': a picture>
        """
        return View(self, page, height)

    def render(self, **options: Any) -> Picture:
        """`filiform.render` of this set.

        >>> s.render(size=(64, 48)).shape
        (48, 64, 3)
        """
        return render(self, **options)


def _kind(value: Any) -> str:
    return type(value).__name__


def _corners(box: Any) -> tuple[Any, Any]:
    try:
        lo, hi = box
    except (TypeError, ValueError):
        raise ValueError("box: expected two corners, shape (2, 3), um") from None
    return lo, hi


def _parts(reader: _core.SegmentReader, rows: int, single: str | None) -> Iterator[Array]:
    while len(part := reader.next(rows)) > 0:
        yield part if single is None else part[single]


def _listed(words: Words) -> str:
    return "" if words is None else words if isinstance(words, str) else ",".join(map(str, words))


def _framed(columns: dict[str, Array], frame: bool | None) -> Any:
    """The columns, or a DataFrame of them; None: a DataFrame if pandas is installed."""
    if frame is None:
        frame = importlib.util.find_spec("pandas") is not None
    if not frame:
        return columns
    import pandas

    return pandas.DataFrame({title: list(c) if c.ndim > 1 else c for title, c in columns.items()})


class _Unopened(Set):
    """A set of a pickle that cannot be opened here. Its use raises the reason: a worker of multiprocessing that raised while it
    reads its task would end, and the caller would wait for ever."""

    def __init__(self, path: str, budget: int, reason: OSError) -> None:
        self._path, self._budget, self._reason = path, budget, reason
        self._cells = None

    @property
    def _handle(self) -> Any:  # type: ignore[override]
        raise self._reason


def _reopen(path: str, revision: str, budget: int) -> Set:
    try:
        return Set(path, budget=budget, revision=revision)
    except OSError as reason:
        return _Unopened(path, budget, reason)


def _grouped(counts: dict[int, int], group_by: str | None) -> Union[int, dict[int, int]]:
    if group_by is None:
        return sum(counts.values())
    if group_by != "cell":
        raise ValueError(f"group_by: expected 'cell' or None, got {group_by!r}")
    return counts
