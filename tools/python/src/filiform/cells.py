"""Cells: the cells of a set, by name or index."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, Iterator, Mapping

import numpy as np
import numpy.typing as npt

from . import _core
from .arrays import Floats, Radii, Ranks, Rows, Types
from .cell import Cell
from .html import cell_table
from .scene import Owner

if TYPE_CHECKING:
    import navis
    import pandas

NO_CELL = 2**32 - 1  #: the index in rows of `Set.nearest` without a segment


def text(raw: bytes) -> str:
    """A name of a file as text. Bytes that are not UTF-8 become surrogates, as `os.fsdecode` makes them."""
    return raw.decode("utf-8", "surrogateescape")


class CellList(list[Cell]):
    """A list of cells, with what concerns them together."""

    def load(self) -> "CellList":
        """Read the arrays of all these cells in one pass over the set, and return the list.

        Several times faster than one cell after the other, above all where cells are entangled or the set is at an
        address. The cells keep their arrays, about 40 bytes a sample. Reads only cells whose arrays are not read yet.

        >>> s.cells.find("L5*").load()
        <filiform.CellList of 2 cells>
        """
        for owner in {cell.set for cell in self}:
            wanted = {cell.index for cell in self if cell.set is owner and not cell.is_loaded}
            if not wanted:
                continue
            indices = sorted(wanted)
            data = dict(zip(indices, _core.read_cells(owner._handle, indices)))
            for cell in self:
                if cell.set is owner and cell.index in data:
                    cell._data = data[cell.index]
        return self

    @property
    def nodes(self) -> list[Rows]:
        """`Cell.nodes` of each cell; reads the cells as `load` does.

        >>> [len(nodes) for nodes in s.cells.find("*").nodes]
        [3, 5, 5]
        """
        return [cell.nodes for cell in self.load()]

    @property
    def vertices(self) -> list[Floats]:
        """`Cell.vertices` of each cell; reads the cells as `load` does.

        >>> np.concatenate(s.cells.find("*").vertices).shape
        (13, 3)
        """
        return [cell.vertices for cell in self.load()]

    @property
    def radius(self) -> list[Radii]:
        """`Cell.radius` of each cell; reads the cells as `load` does.

        >>> [float(radius.max()) for radius in s.cells.find("*").radius]
        [4.0, 5.0, 5.0]
        """
        return [cell.radius for cell in self.load()]

    @property
    def types(self) -> list[Types]:
        """`Cell.types` of each cell; reads the cells as `load` does.

        >>> s.cells.find("L4*").types
        [array([1, 2, 2], dtype=uint16)]
        """
        return [cell.types for cell in self.load()]

    @property
    def ends(self) -> list[Ranks]:
        """`Cell.ends` of each cell; reads the cells as `load` does.

        >>> s.cells.find("L4*").ends[0].tolist()
        [[0, 0], [1, 0], [2, 1]]
        """
        return [cell.ends for cell in self.load()]

    @property
    def edges(self) -> list[Ranks]:
        """`Cell.edges` of each cell; reads the cells as `load` does.

        >>> s.cells.find("L4*").edges[0].tolist()
        [[1, 0], [2, 1]]
        """
        return [cell.edges for cell in self.load()]

    def to_dataframe(self) -> "pandas.DataFrame":
        """A pandas DataFrame, one row a cell: ``index name source samples segments roots loops``. Needs pandas.

        >>> s.cells.find("*").to_dataframe()["name"].tolist()
        ['L4_1', 'L5_1', 'L5_2']
        """
        import pandas

        columns = ["index", "name", "source", "samples", "segments", "roots", "loops"]
        return pandas.DataFrame([[getattr(cell, c) for c in columns] for cell in self], columns=columns)

    def to_navis(self) -> "navis.NeuronList":
        """A navis NeuronList. Needs navis.

        >>> s.cells.find("L5*").to_navis()  # doctest: +SKIP
        """
        import navis

        return navis.NeuronList([cell.to_navis() for cell in self.load()])

    def __repr__(self) -> str:
        return f"<filiform.CellList of {len(self)} cells>"

    def _repr_html_(self) -> str:
        return cell_table(self)


class Cells(Mapping[str, Cell]):
    """The cells of a set. A mapping from names to `Cell`; ``cells[hit["cell"]]`` takes the uint32 of a result too.

    Names are text, also where they are numbers: ids of FlyWire and MICrONS exceed 2**53. Other integers raise
    TypeError, since they may be meant as a name or as an index; `at` takes an index.
    """

    def __init__(self, owner: Owner) -> None:
        self._set = owner

    def index(self, cell: Any) -> int:
        """The index of a cell: of a name, the uint32 of a result, or a Cell of this set. Raises KeyError for an unknown one.

        >>> s.cells.index("L5_1")
        1
        """
        handle = self._set._handle
        if isinstance(cell, Cell):
            if cell.set._id != self._set._id:
                other = "another revision of" if cell.set.path == self._set.path else "another set,"
                raise ValueError(f"cell: {cell.name!r} is a cell of {other} {cell.set.path}")
            return cell.index
        if isinstance(cell, (str, bytes)):
            name = cell if isinstance(cell, bytes) else cell.encode("utf-8", "surrogateescape")
            found = handle.find_cell(name)
            if found is None:
                shown = text(name)
                raise KeyError(f"no cell {shown!r} in {self._set.path}{handle.near_names(name)}")
            return found
        if isinstance(cell, np.uint32):
            return self.at(int(cell)).index
        if isinstance(cell, (int, np.integer)):
            raise TypeError(f"cell: {cell} is an integer, and names are text: use {str(cell)!r}, or cells.at({cell}) for an index")
        raise TypeError(f"cell: expected a name, a cell of a result or a Cell, got {type(cell).__name__}")

    def at(self, index: int) -> Cell:
        """The cell with this index, as results and ``box_counts(group_by="cell")`` have it. Raises KeyError.

        >>> s.cells.at(0).name
        'L4_1'
        """
        try:
            i = operator.index(index)
        except TypeError:
            raise TypeError(f"index: expected an integer, got {type(index).__name__}") from None
        if not 0 <= i < self._set._handle.cell_limit():
            raise KeyError(f"no cell with index {i} in {self._set.path}")
        return Cell(self._set, i)

    def __getitem__(self, cell: Any) -> Cell:
        """The cell of this name, or of the uint32 of a result. Raises KeyError, with names that are alike."""
        return Cell(self._set, self.index(cell))

    def __contains__(self, cell: object) -> bool:
        try:
            self.index(cell)
        except (KeyError, TypeError, ValueError):
            if self._set.closed:
                raise
            return False
        return True

    def __len__(self) -> int:
        return self._set._handle.counts()[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def names(self) -> list[str]:
        """The names, in the order of the indices.

        >>> s.cells.names
        ['L4_1', 'L5_1', 'L5_2']
        """
        return [text(name) for _, name in self._set._handle.cells_named(b"")]

    def find(self, pattern: str) -> CellList:
        """The cells whose whole name matches: ``*`` any text, ``?`` any byte, ``[a-z]`` one of these.

        Letter case does not count.

        >>> s.cells.find("l5_?")
        <filiform.CellList of 2 cells>
        """
        raw = pattern.encode("utf-8", "surrogateescape")
        if not raw:
            return CellList()
        return CellList(Cell(self._set, i) for i, _ in self._set._handle.cells_named(raw))

    def where(self, indices: npt.ArrayLike) -> CellList:
        """The cells of an array of indices, such as ``hits["cell"]``: each once, ascending.

        Rows without a segment, which have the index 2**32 - 1, give no cell.

        >>> [cell.name for cell in s.cells.where(s.nearest([[0, 0, 0], [0, 1, 0]])["cell"])]
        ['L5_1']
        """
        return CellList(self.at(i) for i in np.unique(np.asarray(indices)).tolist() if i != NO_CELL)

    def to_dataframe(self) -> "pandas.DataFrame":
        """A pandas DataFrame, one row a cell. Needs pandas.

        >>> s.cells.to_dataframe()["samples"].sum()
        13
        """
        return self.find("*").to_dataframe()

    def __repr__(self) -> str:
        return f"<{len(self)} cells of {self._set.path!r}>"
