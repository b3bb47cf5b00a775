"""Puts shared libraries of the system into a wheel, and tells on which systems the wheel then runs."""

import hashlib
import os
import pathlib
import platform
import re
import shutil
import subprocess

# What every system that a tag of PEP 600 names has; a graphics driver brings the last two.
PRESENT = re.compile(r"(ld-linux[\w-]*|lib(c|m|dl|rt|pthread|util|resolv|gcc_s|stdc\+\+|GL|EGL))\.so\.\d+")
# The oldest glibc that comes with a libstdc++ of this version.
GLIBC_OF_GLIBCXX = [((3, 4, 24), 28), ((3, 4, 28), 31), ((3, 4, 29), 34), ((3, 4, 30), 35)]


def _told(*command):
    return subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}).stdout


def objects(folder):
    """The programs and libraries below a folder."""
    return [f for f in sorted(folder.rglob("*")) if f.is_file() and f.read_bytes()[:4] == b"\x7fELF"]


def bundle(package, libraries):
    """Copies what the objects in `package` need, and systems may lack, into the folder `libraries` beside it. A copy has a
    name of its own, so that no library of the system stands in for it. Returns the paths of the originals."""
    originals, names = {}, {}
    for thing in objects(package):
        for name, path in re.findall(r"^\s*(\S+) => (not found|\S+)", _told("ldd", thing), re.M):
            if path == "not found":
                raise RuntimeError(f"{thing.name}: the library {name} is not installed")
            if not PRESENT.fullmatch(name):
                originals[name] = pathlib.Path(path).resolve()
    libraries.mkdir()
    for name, path in originals.items():
        stem, dot, rest = name.partition(".so")
        names[name] = f"{stem}-{hashlib.sha256(path.read_bytes()).hexdigest()[:8]}{dot}{rest}"
        shutil.copy(path, libraries / names[name])
        (libraries / names[name]).chmod(0o644)
        subprocess.run(["patchelf", "--set-soname", names[name], libraries / names[name]], check=True)
    for thing in objects(package) + objects(libraries):
        change = [word for name in _told("patchelf", "--print-needed", thing).split() if name in names
                  for word in ("--replace-needed", name, names[name])]
        if change:  # on its own: patchelf 0.14 forgets names in one call with a path
            subprocess.run(["patchelf", *change, thing], check=True)
        place = os.path.relpath(libraries, thing.parent)
        subprocess.run(["patchelf", "--set-rpath", f"$ORIGIN/{place}" if place != "." else "$ORIGIN", thing], check=True)
    return sorted(set(originals.values()))


def platform_tag(things):
    """manylinux_2_N where glibc 2.N holds every version of a symbol that the objects need; else linux."""
    machine = platform.machine()
    glibc = 17
    for thing in things:
        needed = _told("readelf", "-V", "-W", thing)
        if "GLIBC_ABI_DT_RELR" in needed:
            glibc = max(glibc, 36)
        for kind, version in re.findall(r"Name: (GLIBC|GLIBCXX)_([\d.]+)", needed):
            number = tuple(map(int, version.split(".")))
            known = [n for cxx, n in GLIBC_OF_GLIBCXX if number <= cxx] if kind == "GLIBCXX" else [number[1]]
            if not known:
                return f"linux_{machine}"
            glibc = max(glibc, known[0])
    return f"manylinux_2_{glibc}_{machine}"


def licences(paths):
    """What Debian says of the copyright of libraries: name of the package, text."""
    found = {}
    for path in paths if shutil.which("dpkg-query") else []:
        for spelt in (path, pathlib.Path(str(path).removeprefix("/usr"))):  # a package may own /lib/...
            owner = subprocess.run(["dpkg-query", "-S", spelt], capture_output=True, text=True).stdout.partition(":")[0]
            text = pathlib.Path("/usr/share/doc", owner, "copyright")
            if owner and text.is_file():
                found[owner] = text.read_bytes()
    return found
