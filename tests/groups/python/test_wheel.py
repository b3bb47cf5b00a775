"""The wheel and the source distribution: made offline by pip, installed in environments of their own, run there."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile

import pytest

from conftest import run

SOURCE = pathlib.Path(__file__).parents[3] / "tools" / "python"
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {"PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
if os.environ.get("FILIFORM_CAMPAIGN"):
    ENVIRONMENT.pop("FILIFORM_BUILD", None)  # from the sources alone
# What PEP 600 lets a wheel find on each system, and the driver of a picture.
PRESENT = {"libc.so.6", "libm.so.6", "libdl.so.2", "librt.so.1", "libpthread.so.0", "libutil.so.1", "libresolv.so.2", "libgcc_s.so.1",
           "libstdc++.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}


def quietly(command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **{"env": ENVIRONMENT, **options})
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout


def pip_wheel(source, folder, **settings):
    pytest.importorskip("pip", reason="needs python3-pip")
    given = [word for name, value in settings.items() for word in ("--config-settings", f"{name}={value}")]
    quietly([sys.executable, "-m", "pip", "wheel", source, "--no-deps", "-w", folder, *given])
    return next(folder.glob("*.whl"))


def python_of(folder, *options):
    pytest.importorskip("ensurepip", reason="needs python3-venv")
    quietly([sys.executable, "-m", "venv", *options, folder])
    return folder / "bin" / "python"


def last_line_of_import(python, cwd, **environment):
    done = subprocess.run([python, "-c", "import filiform"], capture_output=True, text=True, cwd=cwd, env=ENVIRONMENT | environment)
    assert done.returncode == 1
    assert "During handling" not in done.stderr and "direct cause" not in done.stderr
    return done.stderr.splitlines()[-1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    if not shutil.which("patchelf"):
        pytest.skip("needs patchelf")
    return pip_wheel(SOURCE, tmp_path_factory.mktemp("wheel"))


def test_the_wheel_runs_where_it_is_installed(column, wheel, tmp_path):
    names = zipfile.ZipFile(wheel).namelist()
    assert {"filiform/py.typed", "filiform/_core.pyi", "filiform/__init__.py"} <= set(names)
    assert not [name for name in names if name.endswith(".pyc")]
    python = python_of(tmp_path / "venv", "--system-site-packages")
    quietly([python, "-m", "pip", "install", "--no-deps", wheel])
    told = quietly([python, "-c", f"import filiform as ff; s = ff.open({str(column)!r}); "
                                  "print(ff.__file__, s.nearest([0, 0, 0])['exact'])"], cwd=tmp_path)
    assert told.split() == [str(next((tmp_path / "venv").rglob("filiform/__init__.py"))), "True"]
    run("synth", "-o", tmp_path / "circuit", "--cells", 2, "--seed", 3, "--format", "sonata")
    [h5] = (tmp_path / "circuit").rglob("merged-morphologies.h5")
    told = quietly([python, "-c", f"import filiform as ff; r = ff.ingest({str(h5)!r}, 'h5.fil'); print(r.cells > 0, r.refused)"],
                   env={**ENVIRONMENT, "PATH": "/usr/bin:/bin"}, cwd=tmp_path)
    assert told.split() == ["True", "[]"]
    quietly([python, "-m", "pip", "uninstall", "-y", "filiform"])
    assert not list((tmp_path / "venv").rglob("filiform*"))


def test_the_tag_is_the_glibc_that_the_objects_need(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path)
    things = [f for f in tmp_path.rglob("*") if f.is_file() and f.read_bytes()[:4] == b"\x7fELF"]
    held = {f.name for f in things}
    assert any(name.startswith("_core") for name in held) and "filiform-hdf5" in held
    needed, glibc = set(), 0
    for thing in things:
        own = set(re.findall(r"NEEDED.*\[(.*)\]", quietly(["readelf", "-d", thing])))
        assert own - held <= PRESENT, thing.name
        needed |= own
        glibc = max([glibc] + [int(n) for n in re.findall(r"Name: GLIBC_2\.(\d+)", quietly(["readelf", "-V", "-W", thing]))])
    assert needed & held and "libc.so.6" in needed
    tagged = int(re.search(r"manylinux_2_(\d+)_", wheel.name).group(1))
    assert glibc <= tagged <= max(glibc, 35)  # 35: what the libstdc++ of g++ 12 came with
    size = wheel.stat().st_size
    print(f"{wheel.name}: {size / 1e6:.1f} MB, {len(held)} objects, glibc 2.{glibc}")
    assert size <= 40_000_000


def test_one_line_names_the_numpy_that_is_missing_or_too_new(wheel, tmp_path):
    assert "Requires-Dist: numpy" in zipfile.ZipFile(wheel).read(next(n for n in zipfile.ZipFile(wheel).namelist() if n.endswith("/METADATA"))).decode()
    python = python_of(tmp_path / "venv")
    quietly([python, "-m", "pip", "install", "--no-deps", wheel])
    needs_1 = "numpy<2" in (pathlib.Path(os.environ["FILIFORM_BUILD"]) / "python" / "requires").read_text()
    install = 'pip install "numpy<2"' if needs_1 else "pip install numpy"
    assert last_line_of_import(python, tmp_path) == f"ImportError: filiform needs NumPy, which is not installed: {install}"
    (tmp_path / "new" / "numpy").mkdir(parents=True)
    (tmp_path / "new" / "numpy" / "__init__.py").write_text('__version__ = "2.3.0"\n')
    if needs_1:
        assert last_line_of_import(python, tmp_path, PYTHONPATH=str(tmp_path / "new")) == (
            'ImportError: this build of filiform needs NumPy 1, and NumPy 2.3.0 is installed: pip install "numpy<2"')


def test_a_wheel_without_opengl_says_so_when_it_shall_draw(column, tmp_path):
    wheel = pip_wheel(SOURCE, tmp_path, opengl="off", bundle="off")
    assert "-linux_" in wheel.name  # its libraries are known of this system alone
    assert not [name for name in zipfile.ZipFile(wheel).namelist() if "_render." in name and name.endswith(".so")]
    python = python_of(tmp_path / "venv", "--system-site-packages")
    quietly([python, "-m", "pip", "install", "--no-deps", wheel])
    told = quietly([python, "-c", f"import filiform as ff\ntry:\n ff.render(ff.open({str(column)!r}))\nexcept ImportError as e: print(e)"], cwd=tmp_path)
    assert told.startswith("this build of filiform draws no pictures: ")


def test_an_unknown_setting_is_named(tmp_path):
    pytest.importorskip("pip", reason="needs python3-pip")
    done = subprocess.run([sys.executable, "-m", "pip", "wheel", SOURCE, "--no-deps", "-w", tmp_path, "--config-settings", "opengl=no"],
                          capture_output=True, text=True, env=ENVIRONMENT)
    assert done.returncode != 0
    assert "unknown setting opengl=no; known are opengl=off" in done.stdout + done.stderr


def test_an_editable_install_runs_the_sources_of_the_tree_and_leaves_nothing_there(column, tmp_path):
    tree = SOURCE.parents[1]
    before = quietly(["git", "-C", tree, "status", "--porcelain", "--ignored"]) if (tree / ".git").exists() else ""
    python = python_of(tmp_path / "venv", "--system-site-packages")
    quietly([python, "-m", "pip", "install", "-e", SOURCE, "--no-deps", "--no-build-isolation"])
    told = quietly([python, "-c", f"import filiform as ff; print(ff.__file__, ff.render.__code__.co_filename, ff.open({str(column)!r}).info()['cells'] > 0)"],
                   cwd=tmp_path, env={**ENVIRONMENT, "PYTHONDONTWRITEBYTECODE": "1"})
    package = SOURCE / "src" / "filiform"
    assert told.split() == [str(package / "__init__.py"), str(package / "pictures.py"), "True"]
    if before:
        assert quietly(["git", "-C", tree, "status", "--porcelain", "--ignored"]) == before
    quietly([python, "-m", "pip", "uninstall", "-y", "filiform"])
    assert not list((tmp_path / "venv").rglob("filiform*"))


def test_the_source_distribution_holds_what_the_wheel_needs(tmp_path):
    sys.path.insert(0, str(SOURCE))
    import wheel_backend

    archive = tmp_path / wheel_backend.build_sdist(tmp_path)
    tarfile.open(archive).extractall(tmp_path)
    root = tmp_path / archive.name.removesuffix(".tar.gz")
    for room in "index", "device", "solver", "viewer", "tools/words", "tools/python":
        here = {str(f.relative_to(SOURCE.parents[1])) for f in (SOURCE.parents[1] / room).rglob("*.[ch]*") if f.suffix in (".h", ".cpp")}
        assert here == {str(f.relative_to(root)) for f in (root / room).rglob("*.[ch]*") if f.suffix in (".h", ".cpp")}
    assert (root / "LICENSE").read_text().lstrip().startswith("GNU GENERAL PUBLIC LICENSE")
    # All of its CMake files are there, too. A campaign builds it from there alone.
    rooms = ["cmake", "-S", root, "-B", tmp_path / "build", "-DFILIFORM_ROOMS=viewer;python", f"-DPython_EXECUTABLE={sys.executable}", "-DFILIFORM_TESTS=OFF"]
    quietly(rooms)
    wheel = pip_wheel(archive, tmp_path, bundle="off")
    assert "filiform/__init__.py" in zipfile.ZipFile(wheel).namelist()
    again = tmp_path / "again"
    again.mkdir()
    told = quietly([sys.executable, "-c", f"import sys; sys.path.insert(0, {str(root / 'tools/python')!r}); import wheel_backend; "
                                          f"print(wheel_backend.build_sdist({str(again)!r}))"])
    assert sorted(tarfile.open(again / told.strip()).getnames()) == sorted(tarfile.open(archive).getnames())
