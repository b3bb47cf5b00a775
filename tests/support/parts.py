"""What the scripts share that try a program in parts: tests/groups/cluster/run, tests/groups/ranks/run, tests/groups/service/run, tests/groups/web/run."""
import contextlib
import pathlib
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Skipped(Exception):
    pass


class Failed(Exception):
    pass


def finished(words, most_s, **options):
    """The process of `words`, ended, with its output. After `most_s` seconds it is told to end, and so can end the browser that
    it started; then TimeoutExpired is raised."""
    process = subprocess.Popen([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
    try:
        out, err = process.communicate(timeout=most_s)
    except BaseException:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
        raise
    return subprocess.CompletedProcess(words, process.returncode, out, err)


def built(name, *presets):
    """The program of the first preset that has built it; empty: of none."""
    return next((str(p) for p in (ROOT / "build" / preset / name for preset in presets) if p.exists()), "")


def make_sets(run, program, folder, cells):
    """column.fil, of placed cells, and small.fil."""
    run(program, "synth", folder / "column.zip", "--cells", cells, "--seed", 1, "--placements-out", folder / "column.tsv")
    run(program, "ingest", folder / "column.zip", "--placements", folder / "column.tsv", "-o", folder / "column.fil")
    run(program, "synth", folder / "small.zip", "--cells", 20, "--seed", 2)
    run(program, "ingest", folder / "small.zip", "-o", folder / "small.fil")


@contextlib.contextmanager
def far_away(address, delay_ms, *options):
    """The address behind a slow wire, and the round trip that the wire measured."""
    wire = subprocess.Popen([ROOT / "tests/support/servers/slow_wire", address.split("//")[1], "--delay", str(delay_ms), *options],
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        port = wire.stdout.readline().split()[1]
        yield f"http://127.0.0.1:{port}", wire.stdout.readline().split(",")[0].strip()
    finally:
        wire.stdin.close()
        wire.wait(10)


def run_parts(parts, folder):
    """Prints `ok`, `skipped` or `failed`, the name and the figures or the reason of each part. Returns the exit code."""
    failures = 0
    for part in parts:
        began = time.monotonic()
        try:
            told = part(folder)
            print(f"ok: {part.__name__}: {told} ({time.monotonic() - began:.0f} s)", flush=True)
        except Skipped as reason:
            print(f"skipped: {part.__name__}: {reason}", flush=True)
        except (Failed, OSError, subprocess.SubprocessError) as reason:
            failures += 1
            print(f"failed: {part.__name__}: {reason}", flush=True)
    return 1 if failures else 0
