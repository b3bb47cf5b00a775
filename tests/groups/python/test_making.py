"""The whole program from Python: every option of ingest, neurons in memory, check, verify, compact, remove, export."""

import inspect
import os
import re
import signal
import subprocess
import sys
import threading
import zipfile

import numpy as np
import pytest

import filiform as ff
from conftest import FORK, run

PROGRAM = os.environ.get("FILIFORM_PROGRAM", "filiform")

SWC = np.array([[1, 1, 0, 0, 0, 5, -1], [2, 3, 10, 0, 0, 1, 1], [7, 3, 20, 10.125, 0, 0.5, 2], [4, 2, 0, 40, 0, 0.25, 1]])

# Options of the command that have another form in Python, and what they are there.
OTHERS = {
    "--output": "output", "--no-levels": "levels", "--no-soma-links": "soma_links", "--cell": "cells", "--token-file": "token",
    "--remove": None, "--json": None, "--log": None, "--report": None, "--help": None,
}


@pytest.mark.parametrize("command, function", [("ingest", ff.ingest), ("check", ff.check), ("verify", ff.verify), ("compact", ff.compact)])
def test_every_option_of_the_command_is_an_argument(command, function):
    options = set(re.findall(r"^ +(?:-\w,)?(--[a-z0-9-]+)", run(command, "--help"), re.M))
    arguments = set(inspect.signature(function).parameters)
    by_check = {"--tsv", "--profile", "--ids", "--where", "--box", "--cache-size", "--connections"}  # of check and verify
    missing = []
    for option in sorted(options - (by_check if command != "ingest" else set())):
        argument = OTHERS.get(option, option[2:].replace("-", "_"))
        if argument is not None and argument not in arguments:
            missing.append(option)
    assert len(options) > 3 and not missing


def read_back(path, name):
    with ff.open(path) as opened:
        return opened.cells[name].nodes


def test_arrays_tables_and_graphs_give_the_same_cell(tmp_path):
    pandas, networkx = pytest.importorskip("pandas"), pytest.importorskip("networkx")
    ff.ingest({"array": SWC}, tmp_path / "a.fil")
    nodes = read_back(tmp_path / "a.fil", "array")
    assert nodes["node_id"].tolist() == [1, 2, 7, 4] and nodes["parent_id"].tolist() == [-1, 1, 2, 1]
    assert nodes["y"][2] == 10.125 and nodes["label"].tolist() == [1, 3, 3, 2]

    frame = pandas.DataFrame(nodes)
    frame["label"] = frame["label"].astype("category")

    class Navis:
        name, units = "navis", None
        nodes = frame

    with ff.open(tmp_path / "a.fil") as opened:
        graph = opened.cells["array"].to_networkx()
        graph.name = "graph"
        cell = opened.cells["array"]
        cells = {"structured": nodes, "frame": frame, "navis": Navis(), "graph": graph, "cell": cell}
        report = ff.ingest(cells, tmp_path / "b.fil")
        assert report.cells == 5 and [f.fate for f in report.files] == ["accepted"] * 5
        for name in cells:
            assert (read_back(tmp_path / "b.fil", name) == nodes).all(), name
        assert ff.ingest([Navis(), graph], tmp_path / "c.fil").cells == 2
        assert ff.ingest(frame, tmp_path / "d.fil").cells == 1
        assert read_back(tmp_path / "d.fil", "neuron_0")["node_id"].tolist() == [1, 2, 7, 4]


def test_a_neuron_of_navis_in_voxels_becomes_micrometres(tmp_path):
    pandas = pytest.importorskip("pandas")

    class Unit:
        magnitude = 0.008

        def to(self, name):
            assert name == "micrometer"
            return self

    class Navis:
        name, units = "voxels", Unit()
        nodes = pandas.DataFrame({"node_id": [1, 2], "parent_id": [-1, 1], "x": [0, 1000], "y": [0, 0], "z": [0, 0], "radius": [125, 250]})

    ff.ingest([Navis()], tmp_path / "a.fil")
    nodes = read_back(tmp_path / "a.fil", "voxels")
    assert nodes["x"].tolist() == [0, 8] and nodes["radius"].tolist() == [1, 2]


class Unit:
    """A unit of pint: micrometres in it, by axis or for all."""

    dimensionless = False

    def __init__(self, magnitude):
        self.magnitude = magnitude

    def __str__(self):
        return f"{self.magnitude} um"

    def to(self, name):
        if self.magnitude is None:
            raise ArithmeticError("Cannot convert from second to micrometer")
        return self


def of_navis(units, name="n"):
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"node_id": [1, 2], "parent_id": [-1, 1], "x": [0, 1000], "y": [0, 0], "z": [0, 0], "radius": [125, 250]})

    class Navis:  # with what it derives from its nodes, as navis has it
        nodes, vertices, edges = table, table[["x", "y", "z"]].to_numpy() + 5, np.array([[1, 0]])

    neuron = Navis()
    neuron.units, neuron.name = units, name
    return neuron


def test_a_stated_unit_is_converted_or_refused(tmp_path):
    ff.ingest([of_navis(Unit(np.array([0.008] * 3)))], tmp_path / "a.fil")
    nodes = read_back(tmp_path / "a.fil", "n")
    assert nodes["node_id"].tolist() == [1, 2] and nodes["x"].tolist() == [0, 8] and nodes["radius"].tolist() == [1, 2]
    plain = Unit(1)
    plain.dimensionless = True
    ff.ingest([of_navis(plain)], tmp_path / "b.fil", unit="nm")
    assert read_back(tmp_path / "b.fil", "n")["x"].tolist() == [0, 1]
    for unit, text in (
        (Unit(np.array([0.008, 0.008, 0.03])), r"inputs: n: its unit \[0.008 0.008 0.03.*\] um differs by axis"),
        (Unit(None), "inputs: n: its unit None um is no length: Cannot convert from second"),
    ):
        with pytest.raises(ValueError, match=text):
            ff.ingest([of_navis(unit)], tmp_path / "c.fil")


def test_unit_is_not_applied_to_what_has_its_own(s, tmp_path):
    for inputs in ([of_navis(Unit(0.001))], s.cells.at(0), [s.cells.at(0)], {"n": s.cells.at(0)}):
        for call in (lambda: ff.ingest(inputs, tmp_path / "a.fil", unit="nm"), lambda: ff.check(inputs, unit="nm")):
            with pytest.raises(ValueError, match="unit: .* has a unit of its own; leave unit out"):
                call()
    with pytest.raises(ValueError, match="unit: is for files of neurons"):
        ff.ingest(s.cells.find("*"), tmp_path / "a.fil", unit="nm")
    assert ff.check({"n": SWC}, unit="nm").accepted == 1


def test_lists_of_neurons_are_taken_one_by_one(s, tmp_path):
    class NeuronList:  # attributes are those of all neurons
        neurons = [of_navis(None, "a"), of_navis(None, "b")]
        nodes = neurons[0].nodes

        def __iter__(self):
            return iter(self.neurons)

    assert ff.ingest(NeuronList(), tmp_path / "a.fil").cells == 2
    assert ff.ingest([NeuronList(), SWC], tmp_path / "b.fil").cells == 3
    some = s.cells.find("*")
    assert ff.ingest([some[:1], [some[1], SWC]], tmp_path / "c.fil").cells == 3
    assert ff.check(NeuronList()).accepted == 2
    with pytest.raises(ValueError, match="inputs: all: holds several neurons"):
        ff.ingest({"all": NeuronList()}, tmp_path / "d.fil")


@pytest.mark.parametrize("id", [-3, -1, 2**63, 2**70])
def test_ids_that_no_file_holds_are_named(id, tmp_path):
    networkx = pytest.importorskip("networkx")
    graph = networkx.DiGraph()
    for i, node in enumerate([1, 2, id]):
        graph.add_node(node, x=10 * i, y=0, z=0)
    graph.add_edges_from([(2, 1), (id, 2)])
    table = np.zeros(2, [("node_id", object), ("parent_id", object), ("x", float), ("y", float), ("z", float)])
    table["node_id"], table["parent_id"], table["x"] = [1, id], [-1, 1], [0, 10]
    for neuron in graph, graph.to_undirected(), table:
        with pytest.raises(ValueError, match=f"inputs: n: the id {id} of a node must be from 0"):
            ff.ingest({"n": neuron}, tmp_path / "a.fil")


def test_the_largest_id_stays(tmp_path):
    networkx = pytest.importorskip("networkx")
    graph = networkx.DiGraph()
    for i, node in enumerate([2**53 + 1, 2**63 - 1]):
        graph.add_node(node, x=10 * i, y=0, z=0)
    graph.add_edge(2**63 - 1, 2**53 + 1)
    ff.ingest({"n": graph}, tmp_path / "a.fil")
    assert read_back(tmp_path / "a.fil", "n")["node_id"].tolist() == [2**53 + 1, 2**63 - 1]


def test_loops_and_skeletons_become_graphs(tmp_path):
    networkx = pytest.importorskip("networkx")
    ring = networkx.Graph()
    for i, (x, y) in enumerate([(0, 0), (10, 0), (10, 10), (0, 10)]):
        ring.add_node(i + 5, x=x, y=y, z=0, radius=1)
    ring.add_edges_from([(5, 6), (6, 7), (7, 8), (8, 5)])

    class Skeleton:
        vertices = np.array([[0, 0, 0], [5, 0, 0], [9, 0, 0]])
        edges = np.array([[0, 1], [1, 2]], np.uint32)
        radius = np.array([1, 2, 3])

    ff.ingest({"ring": ring, "skeleton": Skeleton()}, tmp_path / "a.fil")
    with ff.open(tmp_path / "a.fil") as opened:
        assert opened.cells["ring"].loops == 1 and opened.cells["ring"].node_ids.tolist() == [5, 6, 7, 8]
        assert opened.cells["skeleton"].segments == 2 and opened.cells["skeleton"].radius.tolist() == [1, 2, 3]
        ff.ingest({"again": opened.cells["ring"]}, tmp_path / "b.fil")
        assert read_back(tmp_path / "b.fil", "again")["node_id"].tolist() == [5, 6, 7, 8]


@pytest.mark.parametrize("neuron, text", [
    (SWC[:, :6], "inputs: n: expected shape (N, 7), the columns of SWC, got (4, 6)"),
    (np.vstack([SWC, SWC[:1]]), "inputs: n: the ids of nodes must differ"),
    (np.where(SWC == 7, 2.5, SWC), "inputs: n: node_id: expected integers"),
    (np.where(SWC == 10.125, np.nan, SWC), "inputs: n: x, y and z must be finite"),
    (SWC[1:], "inputs: n: the parent 1 of node 2 is no node"),
    (np.zeros(3, [("node_id", int), ("x", float)]), "inputs: n: the column parent_id is missing; it has node_id, x"),
])
def test_mistakes_in_arrays_are_named(neuron, text, tmp_path):
    with pytest.raises(ValueError, match=re.escape(text)):
        ff.ingest({"n": neuron}, tmp_path / "a.fil")
    assert not (tmp_path / "a.fil").exists()


def test_other_mistakes_are_named(tmp_path, example):
    swc = example / "L5_1.swc"
    for arguments, error, text in (
        (dict(inputs={"a/b": SWC}), ValueError, "'a/b' cannot be the name of a cell"),
        (dict(inputs=[SWC[0]]), TypeError, "inputs: expected paths or neurons, got ndarray"),
        (dict(inputs=[5]), TypeError, "inputs: expected paths or neurons, got int"),
        (dict(inputs=[]), ValueError, "inputs: give at least one file"),
        (dict(inputs=swc, version="newest"), ValueError, "version: choose cng, source or both, not 'newest'"),
        (dict(inputs=swc, cells="x"), ValueError, "cells, type: choose from a tile set; inputs is none"),
        (dict(inputs=swc, key="name"), ValueError, "attributes, key: go together"),
        (dict(inputs=swc, attributes=example / "layers.csv"), ValueError, "attributes and key go together"),
        (dict(inputs=swc, delete=True), ValueError, r"delete belongs to sync; filiform.remove\(\) removes one cell"),
        (dict(inputs=swc, sync=True, add=True), ValueError, "sync adds and removes by itself; leave out add$"),
        (dict(inputs=swc, force=True, add=True), ValueError, "leave it out with add and sync$"),
        (dict(inputs=swc, connections=0), ValueError, "connections"),
        (dict(inputs=swc, population="p"), ValueError, "population and morphologies are for one circuit_config.json"),
        (dict(inputs=example / "column.fil", unit="nm"), ValueError, "unit: is for files of neurons; inputs is a tile set"),
        (dict(inputs=example / "column.fil", cells="L6"), KeyError, "no cell 'L6'"),
        (dict(inputs=example / "column.fil", where="layer=9"), ValueError, "no cell of .* is chosen"),
    ):
        with pytest.raises(error, match=text):
            ff.ingest(output=tmp_path / "a.fil", **arguments)
        assert not (tmp_path / "a.fil").exists(), arguments


def test_attributes_come_from_tables(example, tmp_path):
    pandas = pytest.importorskip("pandas")
    swc = sorted(example.glob("*.swc"))
    frame = pandas.DataFrame({"id": ["L4_1", "L5_1", "L5_2"], "depth": [400.5, np.nan, 900], "big": [2**60, 2**60 + 1, 1], "of": ["a", None, "c"]})
    for name, table in ("frame", frame), ("dict", frame.to_dict("list")), ("records", frame.to_records(index=False)):
        report = ff.ingest(swc, tmp_path / f"{name}.fil", attributes=table, key="id")
        assert "attributes: 3; cells with a row: 3" in report.summary
        with ff.open(tmp_path / f"{name}.fil") as opened:
            assert opened.attribute("depth").tolist()[0::2] == [400.5, 900.0] and np.isnan(opened.attribute("depth")[1])
            assert opened.attribute("big").tolist() == [2**60, 2**60 + 1, 1]
            assert opened.attribute("of").tolist() == ["a", None, "c"]
    assert ff.ingest(swc, tmp_path / "path.fil", attributes=example / "layers.csv", key="neuron_name").cells == 3
    wrong = ff.ingest(swc, tmp_path / "wrong.fil", attributes={"id": ["x"], "a": [1]}, key="id")
    assert "no row belongs to a cell" in wrong.note


def test_a_set_gives_a_part_of_itself(example, tmp_path):
    with ff.open(example / "column.fil") as s:
        assert ff.ingest(s, tmp_path / "all.fil").cells == 3
        assert ff.ingest(s.where(layer=5), tmp_path / "five.fil", type="axon,soma").samples == 4
        assert ff.ingest(s, tmp_path / "box.fil", box=[[90, -20, -1], [130, 50, 1]]).cells == 1
        assert ff.ingest(s, tmp_path / "five.fil", cells="L4_1", add=True).cells == 3
        assert ff.ingest([s.cells.find("L5*")], tmp_path / "list.fil").cells == 2
        assert ff.ingest([s], tmp_path / "set.fil").cells == 3
        frame = {"id": ["L4_1"], "depth": [1]}
        for arguments, text in (
            (dict(attributes=frame), "attributes: is for files"), (dict(placements=np.zeros(3)), "placements: is for files"),
            (dict(cache_size="1GiB"), "cache_size: is for files"), (dict(connections=2), "connections: is for files"),
            (dict(token="x"), "token, cache: are for addresses"),
        ):
            with pytest.raises(ValueError, match=text):
                ff.ingest(s, tmp_path / "no.fil", **arguments)
    assert ff.ingest(example / "column.fil", tmp_path / "path.fil", where=["layer>=5", "measure:tips>2"]).cells == 2
    with ff.open(tmp_path / "path.fil") as part:
        assert part.attribute("layer").tolist() == [5, 5]
    with pytest.raises(ValueError, match="same tile set"):
        ff.ingest(example / "column.fil", example / "column.fil", force=True)


def test_a_set_that_ingest_opens_is_closed(example, tmp_path, monkeypatch):
    opened = []

    class Watched(ff.Set):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            opened.append(self)

    monkeypatch.setattr("filiform.set.Set", Watched)
    ff.ingest(example / "column.fil", tmp_path / "a.fil")
    with pytest.raises(ValueError, match="no cell"):
        ff.ingest([str(example / "column.fil")], tmp_path / "b.fil", where="layer=9")
    assert [s.closed for s in opened] == [True, True]


def test_circuits_are_read(tmp_path):
    run("synth", "-o", tmp_path / "circuit", "--cells", 3, "--seed", 3, "--format", "sonata")
    config = next((tmp_path / "circuit").rglob("circuit_config.json"))
    report = ff.ingest(config, tmp_path / "a.fil")
    assert report.cells == 3 and "population" in report.summary
    assert ff.check(config).accepted > 0
    with pytest.raises(ValueError, match="unknown population|population"):
        ff.ingest(config, tmp_path / "b.fil", population="nobody")


def test_a_set_follows_its_folder(example, tmp_path):
    folder = tmp_path / "swc"
    folder.mkdir()
    (folder / "a.swc").write_text(FORK.format(x=0, x10=10, x20=20))
    (folder / "b.swc").write_text(FORK.format(x=50, x10=60, x20=70))
    assert ff.ingest(folder, tmp_path / "a.fil", sync=True).changes["added"] == 2
    (folder / "a.swc").unlink()
    (folder / "c.swc").write_text(FORK.format(x=90, x10=100, x20=110))
    report = ff.ingest(folder, tmp_path / "a.fil", sync=True, delete=True)
    assert (report.changes["added"], report.changes["removed"], report.changes["equal"]) == (1, 1, 1) and report.cells == 2


def test_check_has_a_record_of_each_line(tmp_path):
    (tmp_path / "bad.swc").write_text("1 1 0 0 0 5 -1\n2 3 x 0 0 1 1\n3 3 20 10 0 .5 1\n")
    (tmp_path / "empty.swc").write_text("# nothing\n")
    report = ff.check(tmp_path)
    assert not report.ok and report.accepted == 1 and [f.fate for f in report.files] == ["warned", "refused"]
    record = next(iter(report.records))
    assert (record.input, record.line, record.effect) == ("bad.swc", 2, "dropped") and record.code.startswith("W_") and record.text
    assert report.refused[0][0] == "empty.swc" and report.refused[0][1]
    assert not ff.check(tmp_path / "bad.swc", strict=True).ok
    with pytest.raises(FileNotFoundError, match="no such file"):
        ff.check(tmp_path / "nowhere")


def test_upkeep(example, tmp_path):
    path = tmp_path / "a.fil"
    ff.ingest(sorted(example.glob("*.swc")), path)
    assert ff.remove(["L5_1", "L4_1"], path).cells == 1
    with pytest.raises(ValueError, match="L5_1"):
        ff.remove("L5_1", path)
    assert ff.compact(path).cells == 1
    told = []
    assert ff.verify(path, deep=True, progress=lambda *step: told.append(step)).sound
    pack = next(p for p in path.rglob("*") if p.is_file() and p.suffix not in (".json", "") or p.name.endswith(".pack"))
    content = bytearray(pack.read_bytes())
    content[len(content) // 2] ^= 255
    pack.write_bytes(content)
    report = ff.verify(path)
    assert not report.sound and len(report.problems) >= 1 and "problems" in repr(report)
    with pytest.raises(ValueError, match="sha256: give 64"):
        ff.verify(path, sha256="abc")
    with pytest.raises(OSError):
        ff.verify(tmp_path / "nowhere.fil")


def test_export_is_that_of_the_program(example, tmp_path):
    with ff.open(example / "column.fil") as s:
        assert s.export(tmp_path / "one.swc", "L5_1") == 5
        assert s.export(str(tmp_path / "some") + "/", s.where(layer=5), format="obj") == 10
        s.export(tmp_path / "all.zip")
        run("export", example / "column.fil", "--all", "-o", tmp_path / "program.zip")
        with zipfile.ZipFile(tmp_path / "all.zip") as ours, zipfile.ZipFile(tmp_path / "program.zip") as theirs:
            assert ours.namelist() == theirs.namelist() == ["L4_1.swc", "L5_1.swc", "L5_2.swc"]
            assert all(ours.read(name) == theirs.read(name) for name in ours.namelist())
        s.export(tmp_path / "web.precomputed")
        assert (tmp_path / "web.precomputed" / "info").exists()
        for arguments, text in (
            ((tmp_path / "two.swc",), "is one file, but 3 cells are chosen"),
            ((tmp_path / "a.xyz",), "the ending chooses the format"),
            ((str(tmp_path / "some") + "/",), "not empty"),
        ):
            with pytest.raises(ValueError, match=text):
                s.export(*arguments)
        with pytest.raises(ValueError, match="format tif: choose swc"):
            s.export(tmp_path / "b.zip", format="tif")
    assert (tmp_path / "one.swc").read_text().startswith("# L5_1") and sorted(p.name for p in (tmp_path / "some").iterdir()) == ["L5_1.obj", "L5_2.obj"]


def test_export_spares_the_set_and_needs_a_cell(example, tmp_path):
    ff.ingest(sorted(example.glob("*.swc")), tmp_path / "a.fil")
    (tmp_path / "link").symlink_to(tmp_path / "a.fil" / "CURRENT")
    os.link(tmp_path / "a.fil" / "CURRENT", tmp_path / "hard.swc")
    before = {p: p.read_bytes() for p in (tmp_path / "a.fil").rglob("*") if p.is_file()}
    with ff.open(tmp_path / "a.fil") as s:
        for name in "a.fil/CURRENT", "link", "hard.swc":
            with pytest.raises(ValueError, match="is a file of the tile set, the input; name another file"):
                s.export(tmp_path / name, "L5_1")
        for name in "none.zip", "none.swc", "none/", "none.precomputed":
            with pytest.raises(ValueError, match="no cell is chosen"):
                s.export(f"{tmp_path}/{name}", [])
            assert not (tmp_path / name).exists()
        with pytest.raises(ValueError, match="no cell is chosen"):
            s.export(tmp_path / "none.zip", "L4_1", type="99")
    program = subprocess.run([PROGRAM, "export", tmp_path / "a.fil", "--cell", "L5_1", "-o", tmp_path / "link"], capture_output=True, text=True)
    assert program.returncode != 0 and "is a file of the tile set" in program.stderr
    assert before == {p: p.read_bytes() for p in (tmp_path / "a.fil").rglob("*") if p.is_file()}


def test_ctrl_c_ends_an_ingest_of_arrays(tmp_path):
    code = (
        "import sys, numpy as np, filiform as ff\n"
        "n = 400_000\n"
        "rows = np.zeros((n, 7)); rows[:, 0] = np.arange(1, n + 1); rows[:, 2] = np.arange(n); rows[:, 6] = rows[:, 0] - 1; rows[0, 6] = -1\n"
        "print('ready', flush=True)\n"
        "while True: ff.ingest({'long': rows}, sys.argv[1], force=True)\n")
    child = subprocess.Popen([sys.executable, "-c", code, tmp_path / "a.fil"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    timer = threading.Timer(0.5, child.send_signal, [signal.SIGINT])
    timer.start()
    _, said = child.communicate(timeout=120)
    assert said.strip().splitlines()[-1] == "KeyboardInterrupt" and child.returncode in (1, -signal.SIGINT)
