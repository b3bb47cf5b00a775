"""ff.ingest: results, progress, Ctrl-C, placements, refusals."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import filiform as ff
from conftest import run


def test_report_and_set_agree_with_the_program(archive, column, tmp_path):
    report = ff.ingest(archive, tmp_path / "here.fil")
    run("ingest", archive, "-o", tmp_path / "there.fil")
    with ff.open(tmp_path / "here.fil") as here, ff.open(tmp_path / "there.fil") as there:
        assert here.info() == there.info()
        assert (report.revision, report.cells, report.segments) == \
            (here.revision, len(here.cells), here.info()["segments"])
    assert report.refused == [] and "12" in report.summary and report.note == ""


def test_progress_is_told_on_this_thread(archive, tmp_path):
    import threading
    told = []
    ff.ingest([archive], tmp_path / "a.fil", progress=lambda *a: told.append((threading.get_ident(), *a)))
    for thread, phase, done, total in told:
        assert thread == threading.get_ident() and isinstance(phase, str) and 0 <= done and (not total or done <= total)


def test_an_exception_of_progress_ends_it(tmp_path):
    run("synth", "-o", tmp_path / "big.zip", "--cells", 150, "--seed", 1)

    def stop(phase, done, total):
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        ff.ingest(tmp_path / "big.zip", tmp_path / "a.fil", progress=stop)
    with pytest.raises(OSError):
        ff.open(tmp_path / "a.fil")
    with pytest.raises(TypeError, match="progress"):
        ff.ingest(tmp_path / "big.zip", tmp_path / "a.fil", progress=3)


def test_ctrl_c_ends_it(tmp_path):
    run("synth", "-o", tmp_path / "big.zip", "--cells", 300, "--seed", 1)
    code = f"""
import filiform as ff, sys
try:
    ff.ingest({str(tmp_path / 'big.zip')!r}, {str(tmp_path / 'a.fil')!r}, progress=lambda *a: print(*a, flush=True))
except KeyboardInterrupt:
    sys.exit(42)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    process.stdout.read()
    assert process.wait(60) == 42
    print(f"ended {time.monotonic() - began:.2f} s after Ctrl-C")
    assert not (tmp_path / "a.fil" / "CURRENT").exists()


def test_what_cannot_be_used_is_refused(small, tmp_path):
    (tmp_path / "bad.swc").write_text("nothing\n")
    (tmp_path / "good.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
    with pytest.raises(ValueError, match="usable"):
        ff.ingest(tmp_path / "bad.swc", tmp_path / "a.fil")
    with pytest.raises(ValueError):
        ff.ingest([tmp_path / "bad.swc", tmp_path / "good.swc"], tmp_path / "a.fil", strict=True)
    report = ff.ingest([tmp_path / "bad.swc", tmp_path / "good.swc"], tmp_path / "a.fil")
    assert report.cells == 1 and [name for name, why in report.refused] == ["bad.swc"] and report.refused[0][1]
    with pytest.raises(ValueError, match="force=True replaces it"):
        ff.ingest(tmp_path / "good.swc", tmp_path / "a.fil")
    with pytest.raises(ValueError, match="^unit parsec: give um"):
        ff.ingest(tmp_path / "good.swc", tmp_path / "b.fil", unit="parsec")
    with pytest.raises(FileNotFoundError, match="inputs: .*none.swc"):
        ff.ingest([tmp_path / "good.swc", tmp_path / "none.swc"], tmp_path / "b.fil")
    with pytest.raises(NotADirectoryError, match="filiform.ingest.*good.swc"):
        ff.open(tmp_path / "good.swc")
    assert ff.ingest([tmp_path / "bad.swc", tmp_path / "good.swc"], tmp_path / "a.fil", force=True).unchanged
    for wrong, error in ((dict(inputs=[]), ValueError), (dict(inputs="circuit_config.json"), ValueError), (dict(inputs=tmp_path / "none.swc"), OSError),
                         (dict(inputs=[3]), TypeError), (dict(unit="parsec"), ValueError), (dict(memory=5), ValueError),
                         (dict(memory="lots"), ValueError), (dict(quantum=0.3), ValueError), (dict(capacity=0), ValueError),
                         (dict(threads=-1), ValueError), (dict(output="http://host/a.fil"), (ValueError, OSError))):
        with pytest.raises(error):
            ff.ingest(**{"inputs": tmp_path / "good.swc", "output": tmp_path / "b.fil", **wrong})


def test_units_and_growth(tmp_path):
    (tmp_path / "a.swc").write_text("1 1 0 0 0 1000 -1\n2 3 9000 0 0 1000 1\n")
    (tmp_path / "b.swc").write_text("1 1 0 0 0 1 -1\n2 3 0 5 0 1 1\n")
    ff.ingest(tmp_path / "a.swc", tmp_path / "a.fil", unit="nm")
    ff.ingest(tmp_path / "b.swc", tmp_path / "a.fil", add=True)
    with ff.open(tmp_path / "a.fil") as s:
        assert s.cells.names == ["a", "b"] and s.cells["a"].length == 9 and s.cells["b"].length == 5


def test_placements_are_a_table(tmp_path):
    (tmp_path / "a.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
    half = np.sqrt(0.5)
    table = {"source": ["a.swc", "a.swc"], "x_um": [100, 0], "y_um": [0, 50], "z_um": [0, 0], "qw": [1, half],
             "qx": [0, 0], "qy": [0, 0], "qz": [0, half], "name": ["moved", "turned"]}
    ff.ingest(tmp_path / "a.swc", tmp_path / "a.fil", placements=table)
    with ff.open(tmp_path / "a.fil") as s:
        np.testing.assert_allclose(s.cells["moved"].vertices, [[100, 0, 0], [109, 0, 0]])
        np.testing.assert_allclose(s.cells["turned"].vertices, [[0, 50, 0], [0, 59, 0]], atol=1e-2)
    pandas = pytest.importorskip("pandas", reason="needs python3-pandas")
    ff.ingest(tmp_path / "a.swc", tmp_path / "b.fil", placements=pandas.DataFrame(table))
    with pytest.raises(ValueError, match="x_um"):
        ff.ingest(tmp_path / "a.swc", tmp_path / "c.fil", placements={"source": ["a.swc"]})
    with pytest.raises(ValueError, match="placements"):
        ff.ingest(tmp_path / "a.swc", tmp_path / "c.fil", placements={**table, "qw": [5, 5]})
