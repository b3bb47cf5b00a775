"""What the tests of the Python package share: sets made once a session, and brute force in NumPy.

FILIFORM_PROGRAM names the program `filiform`; PYTHONPATH holds the package that was built.
"""

import os
import pathlib
import subprocess

import numpy as np
import pytest

import filiform as ff

SEED = int(os.environ.get("FILIFORM_SEED", "20261124"))


def pytest_report_header():
    return f"filiform {ff.__version__} in {pathlib.Path(ff.__file__).parent}, seed {SEED}"


def pytest_terminal_summary(terminalreporter):
    """The lines that tools/test counts and lists, as GoogleTest writes them."""
    for report in terminalreporter.stats.get("passed", []):
        if report.when == "call":
            terminalreporter.write_line(f"[       OK ] Python.{report.nodeid.split('/')[-1]} ({report.duration * 1000:.0f} ms)")
    for report in terminalreporter.stats.get("skipped", []):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        terminalreporter.write_line(f"{report.nodeid}: Skipped")
        terminalreporter.write_line(reason.removeprefix("Skipped: "))
        terminalreporter.write_line(f"[  SKIPPED ] Python.{report.nodeid.split('/')[-1]} (0 ms)")


def run(*arguments, **options):
    """Runs the program; returns its standard output."""
    program = os.environ.get("FILIFORM_PROGRAM", "filiform")
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def archive(tmp_path_factory):
    """An archive of 12 synthetic cells."""
    path = tmp_path_factory.mktemp("archive") / "column.zip"
    run("synth", "-o", path, "--cells", 12, "--seed", 5)
    return path


@pytest.fixture(scope="session")
def column(archive, tmp_path_factory):
    """The path of a set of this archive."""
    path = tmp_path_factory.mktemp("set") / "column.fil"
    ff.ingest(archive, path)
    return path


@pytest.fixture
def s(column):
    with ff.open(column) as opened:
        yield opened


LOOP = "node 1 0 0 0 1 1\nnode 2 10 0 0 1 3\nnode 3 10 10 0 1 3\nnode 4 0 10 0 1 3\nnode 5 -5 0 0 1 3\n" \
    "edge 2 1\nedge 3 2\nedge 4 3\nedge 1 4\nedge 5 1\n"


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """The path of a set of three cells: a fork, a loop, and an isolated sample; the last has a name that is not ASCII."""
    folder = tmp_path_factory.mktemp("small")
    (folder / "fork.swc").write_text(
        "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 10 0 .5 2\n4 3 20 -10 0 .5 2\n5 2 0 40 0 nan 1\n")
    (folder / "loop.edges").write_text(LOOP)
    (folder / "é one.swc").write_text("7 3 100 0 0 1 -1\n")
    ff.ingest([folder / "fork.swc", folder / "loop.edges", folder / "é one.swc"], folder / "small.fil")
    return folder / "small.fil"


FORK = "1 1 {x} 0 0 5 -1\n2 3 {x10} 0 0 1 1\n3 3 {x20} 10 0 .5 2\n4 3 {x20} -10 0 .5 2\n5 2 {x} 40 0 .25 1\n"


@pytest.fixture(scope="session")
def example(tmp_path_factory):
    """A folder with what the examples of docstrings use: column.fil, and the three cells that it has, with attributes."""
    folder = tmp_path_factory.mktemp("example")
    for name, x in ("L5_1", 0), ("L5_2", 100):
        (folder / f"{name}.swc").write_text(FORK.format(x=x, x10=x + 10, x20=x + 20))
    (folder / "L4_1.swc").write_text("1 1 0 0 100 4 -1\n2 2 0 30 100 .5 1\n3 2 0 60 100 .5 2\n")
    (folder / "layers.csv").write_text("neuron_name,layer,mtype\nL4_1,4,SP\nL5_1,5,TPC\nL5_2,5,TPC\n")
    run("ingest", *sorted(folder.glob("*.swc")), "--attributes", folder / "layers.csv", "--key", "neuron_name", "-o", folder / "column.fil")
    return folder


class BruteForce:
    """All segments of a set, and their distances to points, in double precision."""

    def __init__(self, opened):
        ends, cells = [], []
        for cell in opened.cells.find("*"):
            edges = cell.edges
            single = np.setdiff1d(np.arange(cell.samples), edges)  # an isolated sample is a segment to itself
            edges = np.concatenate([edges, np.stack([single, single], axis=1).astype(edges.dtype)])
            ends.append(cell.vertices[edges])
            cells.append(np.full(len(edges), cell.index))
        self.ends, self.cells = np.concatenate(ends), np.concatenate(cells)

    def distances(self, point):
        """To each segment."""
        a, b = self.ends[:, 0], self.ends[:, 1]
        along = b - a
        squared = (along**2).sum(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            t = np.where(squared > 0, ((point - a) * along).sum(axis=1) / squared, 0)
        nearest = a + np.clip(t, 0, 1)[:, None] * along
        return np.linalg.norm(nearest - point, axis=1)


@pytest.fixture(scope="session")
def brute(column):
    with ff.open(column) as opened:
        return BruteForce(opened)


@pytest.fixture
def random():
    return np.random.default_rng(SEED)


def points_about(opened, random, count):
    lo, hi = opened.bounds
    return random.uniform(lo - 50, hi + 50, (count, 3))
