"""Neurons in memory, as files that ingest reads: arrays, DataFrames, navis neurons, graphs of networkx."""

from __future__ import annotations

import math
import os
from typing import Any, Iterator, Mapping

import numpy as np

from .arrays import Array

_KINDS = (
    "an array (N, 7) with the columns of SWC, a structured array or DataFrame with node_id parent_id x y z and perhaps "
    "radius and label, a neuron of navis, a skeleton with vertices and edges, or a graph of networkx"
)
_COLUMNS = {
    "id": ("node_id", "id", "rowId", "treenode_id"),
    "parent": ("parent_id", "parent", "link"),
    "type": ("label", "type"),
    "radius": ("radius", "r"),
    "x": ("x",),
    "y": ("y",),
    "z": ("z",),
}


def is_neuron(thing: Any) -> bool:
    """True for what `write` takes."""
    if isinstance(thing, np.ndarray):
        return bool(thing.dtype.names) or thing.ndim == 2
    return any(hasattr(thing, name) for name in ("columns", "nodes", "vertices"))


def _holds_several(thing: Any) -> bool:
    """True for a list, and for a NeuronList of navis, whose attributes are those of all its neurons."""
    return isinstance(thing, (list, tuple)) or not hasattr(thing, "columns") and not hasattr(thing, "dtype") and hasattr(thing, "neurons")


def flat(inputs: Any) -> Iterator[Any]:
    """The inputs one by one, also those of lists and lists of lists."""
    if _holds_several(inputs) or not (isinstance(inputs, (str, os.PathLike)) or is_neuron(inputs)):
        for thing in inputs:
            if _holds_several(thing):
                yield from flat(thing)
            else:
                yield thing
    else:
        yield inputs


def write(neurons: Mapping[str, Any], folder: str, unit: str) -> list[bytes]:
    """Write each neuron to a file of this name: SWC, or an edge list if it has loops. Ids and order stay.

    Raises ValueError if `unit`, which the files will be read in, is not um and a neuron has a unit of its own.
    """
    paths = []
    for name, neuron in neurons.items():
        if not isinstance(name, str) or not name or name.startswith(".") or "/" in name or "\0" in name or len(os.fsencode(name)) > 240:
            raise ValueError(f"inputs: {name!r} cannot be the name of a cell; give text without / of at most 240 bytes")
        if _holds_several(neuron):
            raise ValueError(f"inputs: {name}: holds several neurons; give each its own name, or a list instead of a dict")
        if unit != "um" and (_is_cell(neuron) or _micrometres(neuron, f"inputs: {name}") is not None):
            raise ValueError(f"unit: {name} has a unit of its own; leave unit out, or ingest it alone and add the others")
        text, ending = _text(neuron, f"inputs: {name}")
        paths.append(os.fsencode(os.path.join(folder, name + ending)))
        with open(paths[-1], "w", encoding="utf-8") as file:
            file.write(text)
    return paths


def named(neurons: list[Any]) -> dict[str, Any]:
    """The neurons by their own names; neuron_N for one without."""
    found: dict[str, Any] = {}
    for i, neuron in enumerate(neurons):
        name = getattr(neuron, "name", None)
        name = name if isinstance(name, str) and name else f"neuron_{i}"
        if name in found:
            raise ValueError(f"inputs: two neurons have the name {name!r}; give a dict of names and neurons")
        found[name] = neuron
    return found


def _is_cell(neuron: Any) -> bool:
    return hasattr(neuron, "to_swc") and hasattr(neuron, "loops")


def _text(neuron: Any, where: str) -> tuple[str, str]:
    if _is_cell(neuron):
        if not neuron.loops:
            return neuron.to_swc(), ".swc"
        return _edge_list(neuron.node_ids, neuron.vertices, neuron.radius, neuron.types, neuron.node_ids[neuron.ends], where)
    if hasattr(neuron, "is_directed") and hasattr(neuron, "edges"):
        return _graph(neuron, where)
    is_of_navis = hasattr(neuron, "nodes") and hasattr(neuron.nodes, "columns")
    if not is_of_navis and hasattr(neuron, "vertices") and hasattr(neuron, "edges"):
        vertices = np.asarray(neuron.vertices, float)
        ids = np.arange(len(vertices))
        radius = getattr(neuron, "radius", None)
        if radius is None:
            radius = getattr(neuron, "radii", None)
        return _edge_list(ids, vertices, radius, getattr(neuron, "vertex_types", None), np.asarray(neuron.edges, int), where)
    columns = _columns(neuron.nodes if is_of_navis else neuron, where)
    scale = _micrometres(neuron, where)
    points, radius = np.stack([columns[axis] for axis in "xyz"], axis=1), columns["radius"]
    if scale is not None:
        points, radius = points * scale, radius * scale
    return _swc(columns["id"], columns["type"], points, radius, columns["parent"], where), ".swc"


def _micrometres(neuron: Any, where: str) -> float | None:
    """Micrometres in the unit that the neuron states, as navis does; None if it states none."""
    units: Any = None if hasattr(neuron, "columns") or hasattr(neuron, "dtype") else getattr(neuron, "units", None)
    if not hasattr(units, "to") or getattr(units, "dimensionless", False) is True:
        return None
    try:
        by_axis = np.unique(np.asarray(units.to("micrometer").magnitude, float))
    except Exception as error:
        raise ValueError(f"{where}: its unit {units} is no length: {error}") from error
    if len(by_axis) != 1:
        raise ValueError(f"{where}: its unit {units} differs by axis; convert it first, such as with convert_units('um')")
    return float(by_axis[0])


def _columns(table: Any, where: str) -> dict[str, Array]:
    if isinstance(table, np.ndarray) and not table.dtype.names:
        if table.ndim != 2 or table.shape[1] != 7:
            raise ValueError(f"{where}: expected shape (N, 7), the columns of SWC, got {table.shape}")
        i, t, x, y, z, r, p = np.asarray(table, float).T
        return {"id": i, "type": t, "x": x, "y": y, "z": z, "radius": r, "parent": p}
    names = table.dtype.names if isinstance(table, np.ndarray) else getattr(table, "columns", None)
    if names is None:
        raise TypeError(f"{where}: expected {_KINDS}; got {type(table).__name__}")
    found = {}
    for column, known in _COLUMNS.items():
        name = next((name for name in known if name in names), None)
        if name is not None:
            found[column] = np.asarray(table[name])
        elif column == "radius":
            found[column] = np.full(len(table), np.nan)
        elif column == "type":
            found[column] = np.zeros(len(table), int)
        else:
            raise ValueError(f"{where}: the column {known[0]} is missing; it has {', '.join(map(str, names))}")
    return found


def _integers(values: Array, name: str, where: str) -> list[int]:
    array = np.asarray(values)
    if array.dtype.kind == "O" and all(isinstance(value, (int, np.integer)) for value in array):
        return [int(value) for value in array]
    if array.dtype.kind not in "iub":
        try:
            exact = array.astype(float)
        except (TypeError, ValueError):
            raise ValueError(f"{where}: {name}: expected integers") from None
        if not (np.isfinite(exact) & (exact == np.round(exact))).all():
            raise ValueError(f"{where}: {name}: expected integers")
        array = exact
    return [int(value) for value in array.tolist()]


def _checked(ids: list[int], points: Array, where: str) -> None:
    for number in ids:
        if not 0 <= number < 2**63:
            raise ValueError(f"{where}: the id {number} of a node must be from 0 to 2**63 - 1")
    if len(set(ids)) != len(ids):
        raise ValueError(f"{where}: the ids of nodes must differ")
    if not np.isfinite(points).all():
        raise ValueError(f"{where}: x, y and z must be finite")


def _swc(ids: Array, types: Array, points: Array, radii: Array, parents: Array, where: str) -> str:
    numbers = _integers(ids, "node_id", where)
    above = _integers(parents, "parent_id", where)
    points = np.asarray(points, float)
    _checked(numbers, points, where)
    known = set(numbers)
    for number, parent in zip(numbers, above):
        if parent >= 0 and parent not in known:
            raise ValueError(f"{where}: the parent {parent} of node {number} is no node")
    rows = zip(numbers, _integers(types, "label", where), points.tolist(), np.asarray(radii, float).tolist(), above)
    return "".join(f"{i} {t} {x!r} {y!r} {z!r} {r!r} {p if p >= 0 else -1}\n" for i, t, (x, y, z), r, p in rows)


def _edge_list(ids: Array, points: Array, radii: Any, types: Any, edges: Array, where: str) -> tuple[str, str]:
    numbers = _integers(ids, "ids", where)
    points = np.asarray(points, float)
    if points.shape != (len(numbers), 3):
        raise ValueError(f"{where}: vertices: expected shape (N, 3), got {points.shape}")
    _checked(numbers, points, where)
    edges = np.asarray(edges).reshape(-1, 2)
    known = set(numbers)
    radius = [math.nan] * len(numbers) if radii is None else np.asarray(radii, float).tolist()
    kinds = [0] * len(numbers) if types is None else _integers(types, "types", where)

    def lines() -> Iterator[str]:
        for i, (x, y, z), r, t in zip(numbers, points.tolist(), radius, kinds):
            yield f"node {i} {x!r} {y!r} {z!r} {r!r} {t}\n"
        for child, parent in edges.tolist():
            if child not in known or parent not in known:
                raise ValueError(f"{where}: the edge {child} {parent} ends at no node")
            if child != parent:
                yield f"edge {child} {parent}\n"

    return "".join(lines()), ".edges"


def _graph(graph: Any, where: str) -> tuple[str, str]:
    nodes = list(graph.nodes(data=True))
    for node, values in nodes:
        if isinstance(node, bool) or not isinstance(node, (int, np.integer)):
            raise ValueError(f"{where}: nodes must be integers, the ids of samples; got {node!r}")
        if not all(axis in values for axis in "xyz"):
            raise ValueError(f"{where}: node {node} has no x, y and z")
    ids = np.array([node for node, _ in nodes], dtype=object)
    points = np.array([[values[axis] for axis in "xyz"] for _, values in nodes], float).reshape(-1, 3)
    radii = np.array([values.get("radius", math.nan) for _, values in nodes], float)
    types = [values.get("label", values.get("type", 0)) for _, values in nodes]
    edges = [(a, b) for a, b, *_ in graph.edges]
    parents = dict(edges)
    if graph.is_directed() and len(parents) == len(edges) and _is_forest(parents):
        return _swc(ids, np.array(types), points, radii, np.array([parents.get(n, -1) for n, _ in nodes], dtype=object), where), ".swc"
    return _edge_list(ids, points, radii, np.array(types), np.array(edges, dtype=object).reshape(-1, 2), where)


def _is_forest(parents: Mapping[int, int]) -> bool:
    done: set[int] = set()
    for start in parents:
        way: set[int] = set()
        node = start
        while node in parents and node not in done:
            if node in way:
                return False
            way.add(node)
            node = parents[node]
        done |= way
    return True
