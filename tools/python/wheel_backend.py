"""Makes the wheel, for `pip wheel .` and `python3 -m build`, without a package that pip would have to fetch.

CMake, a compiler and the packages of tools/setup must be installed. The variable FILIFORM_BUILD may name a build folder
in which the target `filiform_python` is built already.
"""

import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
FIELDS = dict(re.findall(r'^(\w[\w-]*) = "(.*)"$', (HERE / "pyproject.toml").read_text(), re.M))
NAME = f"filiform-{FIELDS['version']}"


def get_requires_for_build_wheel(config_settings=None):
    return []


def _metadata():
    return (
        f"Metadata-Version: 2.1\nName: filiform\nVersion: {FIELDS['version']}\nSummary: {FIELDS['description']}\n"
        f"License: GPL-3.0-or-later\nRequires-Python: {FIELDS['requires-python']}\nRequires-Dist: numpy\n"
        f"Description-Content-Type: text/markdown\n\n{(HERE / 'README.md').read_text()}"
    )


def _tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def _build(work):
    """A folder in which the package is built."""
    if given := os.environ.get("FILIFORM_BUILD"):
        return given
    build = work / "build"
    configure = [
        "cmake", "-S", HERE.parents[1], "-B", build, "-DCMAKE_BUILD_TYPE=None", "-DCMAKE_CXX_FLAGS=-O2 -DNDEBUG",
        "-DFILIFORM_PYTHON=ON", "-DFILIFORM_TESTS=OFF", "-DFILIFORM_PRECOMPILE=ON", "-DFILIFORM_BENCH_PEERS=OFF",
        f"-DPython_EXECUTABLE={sys.executable}",
    ]
    if shutil.which("ninja"):
        configure += ["-G", "Ninja"]
    subprocess.run(configure, check=True)
    subprocess.run(["cmake", "--build", build, "--target", "filiform_python", "-j", str(os.cpu_count())], check=True)
    return build


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        installed = work / "installed"
        build = _build(work)
        for component in "python", "wheel":
            subprocess.run(
                ["cmake", "--install", build, "--component", component, "--prefix", installed, "--strip"], check=True
            )
        package = next(installed.rglob("__init__.py")).parent
        contents = {f"filiform/{f.name}": f.read_bytes() for f in sorted(package.iterdir()) if f.is_file()}
        info = f"{NAME}.dist-info"
        contents[f"{info}/METADATA"] = _metadata().encode()
        contents[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: filiform\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode()
        contents[f"{info}/LICENSE"] = (HERE.parents[1] / "LICENSE").read_bytes()
        record = ""
        for name, content in contents.items():
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record += f"{name},sha256={digest},{len(content)}\n"
        contents[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
        wheel = f"{NAME}-{_tag()}.whl"
        with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in contents.items():
                entry = zipfile.ZipInfo(name)  # a fixed date: the same contents give the same bytes
                entry.external_attr = (0o100755 if name == "filiform/filiform-hdf5" else 0o100644) << 16
                entry.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(entry, content)
    return wheel
