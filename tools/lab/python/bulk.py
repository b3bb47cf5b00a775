"""All vertices, types and radii of a set from Python, against decoding all its tiles once in C++: CPU seconds.

    python3 bulk.py SET filiform_python_loop [--repeats 7]
"""

import argparse
import statistics
import subprocess
import time

import filiform as ff

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("set")
parser.add_argument("loop")
parser.add_argument("--repeats", type=int, default=7)
arguments = parser.parse_args()


def of_cells(s):
    cells = s.cells.find("*")
    return cells.vertices, cells.types, cells.radius


FIELDS = "cell,segment,x0,y0,z0,type,radius"
WAYS = {
    "s.segments(fields, chunks=100_000)": lambda s: sum(len(rows) for rows in s.segments(FIELDS, chunks=100_000)),
    "s.segments(fields)": lambda s: s.segments(FIELDS),
    "s.segments()": lambda s: s.segments(),
    "cells.vertices, .types, .radius": of_cells,
    "c.vertices, one cell after the other": lambda s: [(c.vertices, c.types, c.radius) for c in s.cells.find("*")],
}
seconds = {way: [] for way in WAYS}
decode = []
for _ in range(arguments.repeats):  # in turns, so that other work of the machine falls on all
    run = subprocess.run([arguments.loop, arguments.set, "1"], capture_output=True, text=True, check=True)
    decode.append(float(run.stdout.split()[1]))
    for way, read in WAYS.items():
        s = ff.open(arguments.set)
        begin = time.process_time()
        read(s)
        seconds[way].append(time.process_time() - begin)
once = statistics.median(decode)
print(f"{'decoding all tiles once':<40} {once:7.3f} s")
for way, times in seconds.items():
    print(f"{way:<40} {statistics.median(times):7.3f} s, {statistics.median(times) / once:6.2f} times, of {min(times):.3f} to {max(times):.3f} s")
