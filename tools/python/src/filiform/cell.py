"""Cell: one neuron of a set, as arrays; paths along it."""

from __future__ import annotations

import operator
import os
from functools import cached_property
from typing import TYPE_CHECKING, Any, Sequence, Union, overload

import numpy as np
import numpy.typing as npt

from . import _core
from .arrays import Floats, Ids, Picture, Radii, Ranks, Rows, Types
from .pictures import notebook_png, render
from .results import CellPath
from .scene import Owner

if TYPE_CHECKING:
    import navis
    import networkx
    import pandas

_PLACE = "a sample id, 'soma', a point or one row of Set.nearest"


class Cell:
    """One cell of a set. Its arrays are read at first use, kept, and read-only.

    A *place* of a cell is a sample id, ``"soma"``, a point (the nearest sample to it, um), or a row of `Set.nearest`.
    """

    def __init__(self, owner: Owner, index: int) -> None:
        self.set: Any = owner  # the Set
        self.index = index
        self._record  # raises for an unknown index

    @cached_property
    def _record(self) -> tuple[bytes, bytes, int, int, int, int, Floats | None]:
        record: tuple[bytes, bytes, int, int, int, int, Floats | None] | None = self.set._handle.cell_record(self.index)
        if record is None:
            raise KeyError(f"no cell with index {self.index} in {self.set.path}")
        return record

    @property
    def name(self) -> str:
        """The name of the cell in its set.

        >>> c.name
        'L5_1'
        """
        return self._record[0].decode("utf-8", "surrogateescape")

    @property
    def source(self) -> str:
        """The file, or archive and entry, that the cell was read from.

        >>> os.path.basename(c.source)
        'L5_1.swc'
        """
        return self._record[1].decode("utf-8", "surrogateescape")

    @property
    def samples(self) -> int:
        """The number of samples.

        >>> c.samples
        5
        """
        return self._record[2]

    @property
    def segments(self) -> int:
        """The number of segments.

        >>> c.segments
        4
        """
        return self._record[3]

    @property
    def roots(self) -> int:
        """Samples without a parent: the number of separate trees of a cell without loops.

        >>> c.roots
        1
        """
        return self._record[4]

    @property
    def loops(self) -> int:
        """Independent loops; 0 for a cell that SWC can hold.

        >>> c.loops
        0
        """
        return self._record[5]

    @property
    def bounds(self) -> Floats:
        """Lowest and highest corner, shape (2, 3), um.

        >>> c.bounds
        array([[  0., -10.,   0.],
               [ 20.,  40.,   0.]])
        """
        bounds = self._record[6]
        return np.full((2, 3), np.nan) if bounds is None else bounds

    @cached_property
    def _data(self) -> _core.CellData:
        return _core.CellData(self.set._handle, self.index)

    @property
    def is_loaded(self) -> bool:
        """True if its arrays are in memory; `CellList.load` reads those of many cells together.

        >>> cells = s.cells.find("*")
        >>> cells[0].is_loaded, cells.load()[0].is_loaded
        (False, True)
        """
        return "_data" in self.__dict__

    # -- arrays

    @cached_property
    def nodes(self) -> Rows:
        """The samples in the order of the file, with the columns of navis.

        A structured array (N,): ``node_id`` int64, ``label`` int32 (the SWC type), ``x y z radius`` float64 um,
        ``parent_id`` int64, -1 for a root. Unknown radii are nan. For a cell with loops, parents are those of a
        spanning forest; `ends` and `edges` have all links.

        >>> c.nodes[["node_id", "label", "parent_id"]]
        array([(1, 1, -1), (2, 3,  1), (3, 3,  2), (4, 3,  2), (5, 2,  1)], ...
        """
        return self._data.nodes()

    @cached_property
    def node_ids(self) -> Ids:
        """(N,), int64. The ids of the file; where a file restarts its ids, later ones are shifted.

        >>> c.node_ids
        array([1, 2, 3, 4, 5])
        """
        return self._data.node_ids()

    @cached_property
    def vertices(self) -> Floats:
        """(N, 3), float64 um, as CloudVolume's Skeleton has them.

        >>> c.vertices[-1]
        array([ 0., 40.,  0.])
        """
        return self._data.vertices()

    @cached_property
    def ends(self) -> Ranks:
        """(S, 2), uint32: the ends of each segment by its number, as rows of `nodes`: away from the root, and towards it.

        The ``segment`` of a result is the row here, in every cell: ``c.types[c.ends[hits["segment"], 0]]``. The two ends
        are equal for an isolated sample. A cell without loops numbers each segment as its first end, so that a root has
        a row too, with equal ends.

        >>> hit = s.nearest([15, 5, 0])
        >>> c.node_ids[c.ends[hit["segment"]]]
        array([3, 2])
        """
        return self._data.ends()

    @cached_property
    def edges(self) -> Ranks:
        """(E, 2), uint32: the rows of `ends` whose two ends differ, as CloudVolume's Skeleton has them.

        >>> c.edges.tolist()
        [[1, 0], [2, 1], [3, 1], [4, 0]]
        """
        edges: Ranks = self.ends[self.ends[:, 0] != self.ends[:, 1]]
        edges.flags.writeable = False
        return edges

    @cached_property
    def radius(self) -> Radii:
        """(N,), float32 um; nan where unknown.

        >>> c.radius
        array([5.  , 1.  , 0.5 , 0.5 , 0.25], dtype=float32)
        """
        return self._data.radius()

    @cached_property
    def types(self) -> Types:
        """(N,), uint16: the SWC types.

        >>> c.types
        array([1, 3, 3, 3, 2], dtype=uint16)
        """
        return self._data.types()

    @cached_property
    def length(self) -> float:
        """The sum of the lengths of all segments, um.

        >>> round(c.length, 3)
        78.284
        """
        ends = self.vertices[self.edges]
        return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum())

    # -- along the cell

    def path(self, start: Any, end: Any = None) -> CellPath:
        """The shortest path along the cell between two places; without `end`, to the tip that is farthest along it.

        Raises KeyError for an unknown sample, ValueError if the places lie on separate trees.

        >>> c.path(5, 3)
        <filiform.CellPath of 4 points: 64.14 um, 36.06 um straight>
        >>> c.path("soma").samples
        array([1, 5])
        """
        return CellPath(*self._data.path(self._place("start", start), None if end is None else self._place("end", end)))

    def distances(self, start: Any) -> Floats:
        """The length of the path from a place to each sample: (N,), float64 um; inf on other trees.

        >>> c.distances(1).round(1)
        array([ 0. , 10. , 24.1, 24.1, 40. ])
        """
        return self._data.lengths_from(self._place("start", start))

    def tips(self, start: Any, most: int | None = None) -> Ids:
        """Sample ids of the tips that a path reaches, nearest along it first: int64.

        >>> c.tips("soma")
        array([3, 4, 5])
        """
        return self._data.tips(self._place("start", start), most)

    @overload  # type: ignore
    def snap(self, locs: Sequence[float]) -> tuple[np.int64, np.float64]: ...

    @overload
    def snap(self, locs: npt.ArrayLike) -> tuple[Ids, Floats]: ...

    def snap(self, locs: npt.ArrayLike) -> tuple[Union[Ids, np.int64], Union[Floats, np.float64]]:
        """The nearest samples, as ``navis.TreeNeuron.snap`` finds them: ids (int64) and distances (um).

        locs has the shape (3,) or (N, 3). Compares all samples with all points.

        >>> ids, distances = c.snap([[1, 39, 0]])
        >>> ids
        array([5])
        """
        return self._data.snap(locs)

    def _place(self, name: str, place: Any) -> Any:
        if isinstance(place, np.void) or (isinstance(place, np.ndarray) and place.dtype.names):
            if place.shape != () or not {"cell", "segment", "x", "y", "z"} <= set(place.dtype.names or ()):
                raise ValueError(f"{name}: expected {_PLACE}")
            if int(place["cell"]) != self.index:
                raise ValueError(f"{name}: this row lies on the cell with index {int(place['cell'])}, not on {self.name!r}")
            return int(place["segment"]), [float(place["x"]), float(place["y"]), float(place["z"])]
        if isinstance(place, str):
            return place
        if isinstance(place, (list, tuple)) or (isinstance(place, np.ndarray) and place.shape != ()):
            return np.asarray(place)
        try:
            return operator.index(place)
        except TypeError:
            raise TypeError(f"{name}: expected {_PLACE}, got {type(place).__name__}") from None

    # -- for other libraries

    def to_networkx(self) -> "networkx.DiGraph":
        """A ``networkx.DiGraph`` from child to parent, as navis makes it.

        Nodes are sample ids with ``x y z radius label``; edges have ``weight``, their length in um. Needs networkx.

        >>> c.to_networkx().edges[3, 2]["weight"].__round__(2)
        14.14
        """
        import networkx

        graph = networkx.DiGraph(name=self.name, units=self.set.units)
        nodes = self.nodes
        names = ("x", "y", "z", "radius", "label")
        columns = [nodes[name].tolist() for name in names]
        ids = self.node_ids.tolist()
        graph.add_nodes_from(
            (node, {"x": x, "y": y, "z": z, "radius": r, "label": t}) for node, x, y, z, r, t in zip(ids, *columns)
        )
        ends = self.vertices[self.edges]
        lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).tolist()
        children, parents = self.node_ids[self.edges].T.tolist() if len(self.edges) else ([], [])
        graph.add_weighted_edges_from(zip(children, parents, lengths))
        return graph

    def to_dataframe(self) -> "pandas.DataFrame":
        """`nodes` as a pandas DataFrame. ``label`` is categorical, as in navis. Needs pandas.

        >>> c.to_dataframe()["node_id"].tolist()
        [1, 2, 3, 4, 5]
        """
        import pandas

        frame = pandas.DataFrame({name: self.nodes[name] for name in self.nodes.dtype.names or ()})
        frame["label"] = frame["label"].astype("category")
        return frame

    def to_navis(self) -> "navis.TreeNeuron":
        """A ``navis.TreeNeuron`` (``Skeleton`` in navis 2). Needs navis.

        >>> c.to_navis()  # doctest: +SKIP
        """
        import navis

        kind = navis.TreeNeuron if hasattr(navis, "TreeNeuron") else navis.Skeleton
        return kind(self.to_dataframe(), name=self.name, id=self.name, units=self.set.units)

    def to_swc(self, path: Union[str, "os.PathLike[str]", None] = None) -> str | None:
        """Write the cell as SWC, with its original ids; without `path`, return the text.

        A file is replaced only when all is written. Raises ValueError for a cell with loops, OSError.

        >>> print(c.to_swc())
        # L5_1
        ...
        5 2 0 40 0 0.25 1
        """
        if path is None:
            return self._data.swc().decode("utf-8", "surrogateescape")
        self._data.write_swc(os.fsencode(path))
        return None

    def render(self, **options: Any) -> Picture:
        """`filiform.render` of this cell.

        >>> c.render(size=(64, 48)).shape
        (48, 64, 3)
        """
        return render(self, **options)

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self.set, self.index)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Cell) and self.index == other.index and self.set == other.set

    def __hash__(self) -> int:
        return hash((self.set, self.index))

    def __dask_tokenize__(self) -> tuple[Any, ...]:
        return ("filiform.Cell", *self.set._id, self.index)

    def __repr__(self) -> str:
        return f"<filiform.Cell {self.name!r}: {self.segments} segments>"

    def _repr_png_(self) -> bytes | None:
        return notebook_png(self)

    def _scene(self) -> tuple[Owner, int | None, Floats | None]:
        return self.set, self.index, self.bounds


def _again(owner: Owner, index: int) -> Cell:
    """A cell of a pickle. What is wrong with its set is raised when the cell is used."""
    cell = Cell.__new__(Cell)
    cell.set, cell.index = owner, index
    return cell
