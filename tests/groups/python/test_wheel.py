"""The wheel: made offline by pip, installed in an environment of its own, run there."""

import os
import pathlib
import subprocess
import sys
import zipfile

import pytest

from conftest import run

SOURCE = pathlib.Path(__file__).parents[3] / "tools" / "python"


def quietly(command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout


def test_the_wheel_runs_where_it_is_installed(column, tmp_path):
    pytest.importorskip("pip", reason="needs python3-pip")
    pytest.importorskip("ensurepip", reason="needs python3-venv")
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment.update(PIP_NO_INDEX="1", PIP_DISABLE_PIP_VERSION_CHECK="1")
    if os.environ.get("FILIFORM_CAMPAIGN"):
        environment.pop("FILIFORM_BUILD", None)  # from the sources alone
    quietly([sys.executable, "-m", "pip", "wheel", ".", "--no-deps", "-w", tmp_path], cwd=SOURCE, env=environment)
    [wheel] = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {"filiform/py.typed", "filiform/_core.pyi", "filiform/__init__.py"} <= set(names)
    assert not [name for name in names if name.endswith(".pyc")]
    quietly([sys.executable, "-m", "venv", "--system-site-packages", tmp_path / "venv"])
    python = tmp_path / "venv" / "bin" / "python"
    quietly([python, "-m", "pip", "install", "--no-deps", wheel], env=environment)
    told = quietly([python, "-c", f"import filiform as ff; s = ff.open({str(column)!r}); "
                                  "print(ff.__file__, s.nearest([0, 0, 0])['exact'])"], env=environment, cwd=tmp_path)
    assert told.split() == [str(next((tmp_path / "venv").rglob("filiform/__init__.py"))), "True"]
    run("synth", "-o", tmp_path / "circuit", "--cells", 2, "--seed", 3, "--format", "sonata")
    [h5] = (tmp_path / "circuit").rglob("merged-morphologies.h5")
    told = quietly([python, "-c", f"import filiform as ff; r = ff.ingest({str(h5)!r}, 'h5.fil'); print(r.cells > 0, r.refused)"],
                   env={**environment, "PATH": "/usr/bin:/bin"}, cwd=tmp_path)
    assert told.split() == ["True", "[]"]
    quietly([python, "-m", "pip", "uninstall", "-y", "filiform"], env=environment)
    assert not list((tmp_path / "venv").rglob("filiform"))
