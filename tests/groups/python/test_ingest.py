"""ff.ingest: results, progress, Ctrl-C, placements, refusals."""

import os
import pathlib
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


def damaged(folder):
    """A folder below with files and archives that are kept with remarks, skipped in part, and refused."""
    import io
    import zipfile
    folder = folder / "given"
    folder.mkdir()
    good = "1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n"
    (folder / "good.swc").write_text(good)
    (folder / "bad.swc").write_text("nothing\n")
    (folder / "odd.swc").write_text("1 1 0 0 0 x -1\n2 3 9 0 0 1 3\n3 3 9 9 0 1 2\n2 3 1 1 1 1 1\n")
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as nested:
        nested.writestr("deep.swc", good)
    with zipfile.ZipFile(folder / "mixed.zip", "w") as mixed:
        for name in ("one.swc", "one.CNG.swc", "bad.swc", "../evil.swc"):
            mixed.writestr(name, "x\n" if name == "bad.swc" else good)
        mixed.writestr("nested.zip", inner.getvalue())
    content = (folder / "mixed.zip").read_bytes()
    (folder / "cut.zip").write_bytes(content[:len(content) // 2])
    with zipfile.ZipFile(folder / "empty.zip", "w") as empty:
        empty.writestr("bad.swc", "x\n")
    (folder / "none.zip").write_bytes(b"no archive")
    return folder


def without_anatomy(rows):
    """The rows of a report of check without what ingest does not look at."""
    return [{key: without_anatomy(value) if key == "entries" else value for key, value in row.items()
             if key != "anatomy"} for row in rows]


@pytest.mark.parametrize("made", [True, False], ids=["made_here", "corpus"])
def test_all_reports_of_a_run_agree(tmp_path, made):
    import json
    import pickle
    import re
    if not made and "FILIFORM_CORPUS" not in os.environ:
        pytest.skip("needs FILIFORM_CORPUS, a folder with malformed/")
    folder = damaged(tmp_path) if made else pathlib.Path(os.environ["FILIFORM_CORPUS"], "malformed")
    set_path = tmp_path / "a.fil"
    report = ff.ingest(folder, set_path)
    told = run("ingest", folder, "-o", tmp_path / "b.fil", "--report", tmp_path / "b.json")
    check = subprocess.run([os.environ.get("FILIFORM_PROGRAM", "filiform"), "check", folder, "--json", "--report",
                            tmp_path / "c.json"], capture_output=True, text=True)
    checked = json.loads(check.stdout)
    rows = json.loads((tmp_path / "b.json").read_text())
    assert check.returncode == 1 and json.loads((tmp_path / "c.json").read_text()) == checked["files"]
    assert rows == without_anatomy(checked["files"])

    # The text.
    assert told.startswith(report.summary)
    count = {word: int(n.replace(" ", "")) for n, word in
             re.findall(r"([\d ]+) (accepted|with warnings|skipped|refused)", report.summary.splitlines()[0])}
    assert len(report.refused) == count["refused"] == checked["refused"] > 0
    assert len(report.skipped) == count.get("skipped", 0) == checked["skipped"]
    assert report.accepted == count["accepted"] + count["with warnings"] == checked["accepted"] + checked["warned"]
    for name, why in report.refused[:20]:
        assert f"refused {name}: {why} (" in report.summary or "\\x" in report.summary

    # --report and check --json.
    lost = {"refused": [], "skipped": []}
    kept = 0
    for row in rows:
        for part, name in [(row, row["file"])] + [(e, row["file"] + "/" + e["entry"]) for e in row.get("entries", [])]:
            if part.get("fate") in lost:
                lost[part["fate"]].append((name, part["reason"]))
            kept += part.get("fate") in ("accepted", "warned")
    plain = [[(name.encode("ascii", "replace"), why) for name, why in pairs] for pairs in (report.refused, report.skipped)]
    assert [[(n.encode("ascii", "replace"), w) for n, w in lost[k]] for k in ("refused", "skipped")] == plain
    assert kept == report.accepted
    assert report.passed_over == checked["passed_over"]

    # The table of check: one row a file.
    table = subprocess.run([os.environ.get("FILIFORM_PROGRAM", "filiform"), "check", folder, "--tsv"], capture_output=True, text=True)
    severities = [line.split("\t")[1] for line in table.stdout.splitlines()[1:]]
    assert severities == [row["severity"] for row in rows]

    # Provenance, and what info says of it.
    with ff.open(set_path) as opened:
        info = opened.info()
        provenance = json.loads((set_path / opened.revision / "provenance.json").read_text())
    other = [name for name, why in report.skipped if "in another version" in why]  # counted by their code
    assert info["refused"] == len(info["refused_inputs"]) == len(provenance["refused"]) == len(report.refused)
    assert info["skipped"] == len(info["skipped_inputs"]) == len(provenance.get("skipped", [])) == len(report.skipped) - len(other)
    assert sorted(r["reason"] for r in provenance["refused"]) == sorted(why for _, why in report.refused)
    assert all(r["code"] for r in provenance["refused"] + provenance.get("skipped", []))
    assert sum(source["cells"] for source in provenance["sources"]) == report.cells >= report.accepted
    assert "--strict" not in json.dumps(provenance) + report.summary

    # The records.
    records = list(report.records)
    assert len(records) == len(report.records) == sum(
        len(part["records"]) for row in rows for part in [row, *row.get("entries", [])])
    assert pickle.loads(pickle.dumps(report)).records == records
    told_records = [(r["line"], r["code"], r["effect"]) for row in rows for part in [row, *row.get("entries", [])]
                    for r in part["records"]]
    assert [(r.line, r.code, r.effect) for r in records] == told_records
    if made:
        assert [(r.line, r.code, r.effect) for r in records if r.input == "odd.swc"] == [
            (1, "W_BAD_RADIUS", "kept"), (2, "W_CYCLE", "cut"), (4, "W_DUP_ID", "dropped")]
        assert {"cut.zip", "none.zip", "bad.swc", "empty.zip/bad.swc"} == {name for name, _ in report.refused}
        assert "W_CYCLE 1: parents form a cycle; one link cut (first: odd.swc:" in report.summary


def test_strict_writes_the_report_and_names_the_first(tmp_path):
    import json
    folder = damaged(tmp_path)
    with pytest.raises(ValueError, match=r"^strict: \d+ of \d+ inputs refused, nothing written; the first is bad.swc: "):
        ff.ingest(folder, tmp_path / "a.fil", strict=True)
    done = subprocess.run([os.environ.get("FILIFORM_PROGRAM", "filiform"), "ingest", folder, "--strict", "-o", tmp_path / "a.fil",
                           "--report", tmp_path / "a.json"], capture_output=True, text=True)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1 and not (tmp_path / "a.fil" / "CURRENT").exists()
    fates = {row["file"]: (row.get("fate"), row.get("reason", "")) for row in json.loads((tmp_path / "a.json").read_text())}
    assert fates["good.swc"][0] == "accepted" and fates["odd.swc"][0] == "refused" and "W_CYCLE:1" in fates["odd.swc"][1]


def test_a_missing_reader_of_hdf5_refuses_that_file_alone(tmp_path, monkeypatch):
    (tmp_path / "good.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
    run("synth", "-o", tmp_path / "circuit", "--cells", 3, "--seed", 3, "--format", "sonata")
    h5 = list((tmp_path / "circuit").rglob("merged-morphologies.h5"))
    report = ff.ingest([tmp_path / "good.swc", *h5], tmp_path / "a.fil")
    assert report.refused == [] and report.cells > 1
    for program in ("/nowhere/filiform-hdf5", str(tmp_path / "good.swc")):
        monkeypatch.setenv("FILIFORM_HDF5", program)
        report = ff.ingest([tmp_path / "good.swc", *h5], tmp_path / "a.fil", force=True)
        assert report.cells == 1 and [name for name, _ in report.refused] == [p.name for p in h5]
        assert all("cannot start" in why and "FILIFORM_HDF5" in why for _, why in report.refused)


def test_a_mouselight_file_is_no_circuit(tmp_path):
    import json
    sample = dict(x=0, y=0, z=0, radius=1, structureIdentifier=2, allenId=1)
    (tmp_path / "AA0001.json").write_text(json.dumps({"comment": "", "neurons": [{
        "idString": "AA0001", "sampleSpacing": {}, "soma": {"x": 0, "y": 0, "z": 0},
        "axon": [{**sample, "sampleNumber": 1, "parentNumber": -1}, {**sample, "sampleNumber": 2, "parentNumber": 1, "x": 9}],
        "dendrite": []}]}))
    report = ff.ingest(tmp_path / "AA0001.json", tmp_path / "a.fil")
    assert report.cells == 1 and report.samples == 2
    (tmp_path / "Circuit_Config.json").write_text('{"manifest": {}, "networks": {"nodes": []}}')
    with pytest.raises(ValueError, match="Circuit_Config.json: `networks.nodes` is empty"):
        ff.ingest(tmp_path / "Circuit_Config.json", tmp_path / "b.fil")


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
    for wrong, error in ((dict(inputs=[]), ValueError), (dict(inputs=tmp_path / "none.swc"), OSError),
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


def test_names_of_placements_stay_text(tmp_path):
    (tmp_path / "7.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
    ids = [720575940621039145, 720575940621039146]
    place = {"source": ["7.swc", "7.swc"], "x_um": [0, 50], "y_um": [0, 0], "z_um": [0, 0]}
    wanted = [str(i) for i in ids]
    for names in (ids, np.array(ids), np.array(ids, "u8"), wanted, [name.encode() for name in wanted], np.array(wanted, "S20"),
                  np.array(ids, object)):
        ff.ingest(tmp_path / "7.swc", tmp_path / "a.fil", placements={**place, "name": names}, force=True)
        with ff.open(tmp_path / "a.fil") as s:
            assert sorted(s.cells.names) == wanted
    for missing in (None, float("nan"), ""):
        ff.ingest(tmp_path / "7.swc", tmp_path / "a.fil", placements={**place, "name": [missing, "1e5"]}, force=True)
        with ff.open(tmp_path / "a.fil") as s:
            assert sorted(s.cells.names) == ["1e5", "7"]  # without a name, that of the file
    for wrong in (7.2e17, True, 3 + 2j, object(), ["x"]):
        with pytest.raises(TypeError, match="placements: name: expected text or an integer"):
            ff.ingest(tmp_path / "7.swc", tmp_path / "a.fil", placements={**place, "name": [wrong, "b"]}, force=True)
    with pytest.raises(TypeError, match="placements: x_um: expected a number, got None"):
        ff.ingest(tmp_path / "7.swc", tmp_path / "a.fil", placements={**place, "x_um": [None, 1]}, force=True)
    pandas = pytest.importorskip("pandas", reason="needs python3-pandas")
    table = pandas.DataFrame({**place, "name": pandas.array([ids[0], None], "Int64")})
    ff.ingest(tmp_path / "7.swc", tmp_path / "a.fil", placements=table, force=True)
    with ff.open(tmp_path / "a.fil") as s:
        assert sorted(s.cells.names) == ["7", wanted[0]]


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
