# An independent reading of a SONATA circuit by h5py and numpy: cells, segments, length, box and mean direction of local
# +y, as one JSON object. Used by circuit_command_test.cpp.
#   circuit_figures.py CONFIG
import csv
import json
import os
import sys

import h5py
import numpy as np


def resolve(text, manifest, folder):
    for _ in range(10):
        for name, value in manifest.items():
            text = text.replace(name, value)
    return os.path.normpath(os.path.join(folder, text))


def column(population, types, name, node):
    """The value of a node: of its group, else of its type."""
    if "node_group_id" in population:
        group = population[str(population["node_group_id"][node])]
        row = population["node_group_index"][node]
    else:
        group, row = population["0"], node
    if name in group:
        value = group[name][row]
        if "@library" in group and name in group["@library"]:
            value = group["@library"][name][value]
        return value.decode() if isinstance(value, bytes) else value
    value = types.get(int(population["node_type_id"][node]), {}).get(name)
    return None if value == "NULL" else value


def rotation(population, types, node):
    q = [column(population, types, "orientation_" + c, node) for c in "wxyz"]
    if q[0] is not None:
        w, x, y, z = np.array(q, float) / np.linalg.norm(np.array(q, float))
        return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    a, b, c = [float(column(population, types, f"rotation_angle_{n}axis", node) or 0) for n in "xyz"]
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return rx @ ry @ rz


def from_h5(group):
    """Points of the neurites and the centre of the soma; pairs of rows that are linked."""
    points = np.array(group["points"])[:, :3].astype(float)
    structure = np.array(group["structure"])
    starts = np.append(structure[:, 0], len(points))
    soma = [s for s in range(len(structure)) if structure[s, 1] == 1]
    contour = np.concatenate([points[starts[s]:starts[s + 1]] for s in soma])
    kept = [contour.mean(axis=0)]
    links, last = [], {}
    for s in range(len(structure)):
        if structure[s, 1] == 1:
            continue
        before = last.get(structure[s, 2])
        for row in range(starts[s], starts[s + 1]):
            if row == starts[s] and before is not None and np.array_equal(points[row], kept[before]):
                continue
            kept.append(points[row])
            if before is not None:
                links.append((before, len(kept) - 1))
            before = len(kept) - 1
        last[s] = before
    return np.array(kept), np.array(links), kept[0]


def from_swc(path):
    rows = np.loadtxt(path, ndmin=2)
    place = {int(row[0]): i for i, row in enumerate(rows)}
    links = [(i, place[int(row[6])]) for i, row in enumerate(rows) if row[6] != -1]
    soma = rows[rows[:, 1] == 1, 2:5]
    mean = soma.mean(axis=0)
    outline = len(soma) > 3 and np.linalg.norm(mean) < np.linalg.norm(soma - mean, axis=1).max()
    return rows[:, 2:5], np.array(links), np.zeros(3) if outline else mean


def main(config_path):
    folder = os.path.dirname(config_path)
    config = json.load(open(config_path))
    manifest = config.get("manifest", {})
    cells = segments = 0
    length = 0.0
    lo, hi, up = np.full(3, np.inf), np.full(3, -np.inf), np.zeros(3)
    for nodes in config["networks"]["nodes"]:
        types = {}
        if nodes.get("node_types_file"):
            with open(resolve(nodes["node_types_file"], manifest, folder)) as table:
                types = {int(row["node_type_id"]): row for row in csv.DictReader(table, delimiter=" ")}
        file = h5py.File(resolve(nodes["nodes_file"], manifest, folder), "r")
        for name, population in file["nodes"].items():
            stated = nodes.get("populations", {}).get(name, {})
            places = {**config.get("components", {}), **stated}
            if stated.get("type") == "virtual":
                continue
            known = {}
            for node in range(len(population["node_type_id"])):
                morphology = column(population, types, "morphology", node)
                if not morphology:
                    continue
                if morphology not in known:
                    if places.get("morphologies_dir"):
                        base = resolve(places["morphologies_dir"], manifest, folder)
                        known[morphology] = from_swc(os.path.join(base, morphology + ".swc"))
                    else:
                        container = h5py.File(resolve(places["alternate_morphologies"]["h5v1"], manifest, folder), "r")
                        known[morphology] = from_h5(container[morphology])
                points, links, soma = known[morphology]
                turn = rotation(population, types, node)
                place = np.array([float(column(population, types, axis, node)) for axis in "xyz"])
                placed = (points - soma) @ turn.T + place
                cells += 1
                segments += len(links)
                length += np.linalg.norm(placed[links[:, 0]] - placed[links[:, 1]], axis=1).sum()
                lo, hi = np.minimum(lo, placed.min(axis=0)), np.maximum(hi, placed.max(axis=0))
                up += turn @ np.array([0, 1, 0])
    print(json.dumps({"cells": cells, "segments": segments, "length_um": length, "lo": lo.tolist(), "hi": hi.tolist(),
                      "mean_y": float(np.linalg.norm(up / max(cells, 1)))}))


main(sys.argv[1])
