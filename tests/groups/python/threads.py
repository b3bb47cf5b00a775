"""Threads that use one set in every way at once: a module for tests, and a program.

    python3 threads.py SET SECONDS [THREADS]
"""

import sys
import threading
import time

import numpy as np


def hammer(opened, seconds, threads):
    """Runs `threads` threads for `seconds`. Each compares its answers with those of one thread before."""
    lo, hi = opened.bounds
    points = np.random.default_rng(7).uniform(lo, hi, (400, 3))
    wanted = opened.nearest(points, k=3)
    box = opened.box_query(points[0] - 30, points[0] + 30)
    names = opened.cells.names
    nodes = opened.cells.at(0).nodes
    level = len(opened.levels(opened.bounds, 200).segments)
    end = time.monotonic() + seconds
    problems = []
    rounds = [0] * threads

    def use(number):
        try:
            while time.monotonic() < end:
                assert (opened.nearest(points, k=3, workers=1 + number % 2) == wanted).all()
                for point, row in zip(points[:20], wanted[:20]):
                    assert (opened.nearest(point, k=3) == row).all()
                assert (opened.box_query(points[0] - 30, points[0] + 30) == box).all()
                cell = type(opened.cells.at(0))(opened, 0)
                assert (cell.nodes["x"] == nodes["x"]).all() and len(cell.path(int(cell.node_ids[0])).points) > 1
                assert opened.cells.names == names and opened.cells.find(names[1])[0].index == 1
                assert len(opened.levels(opened.bounds, 200).segments) == level
                opened.ray(points[1], [0, 1, 0], radius=5)
                opened.info()
                rounds[number] += 1
        except BaseException as error:
            problems.append(error)
            raise

    workers = [threading.Thread(target=use, args=(n,)) for n in range(threads)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not problems, problems
    return sum(rounds)


if __name__ == "__main__":
    import filiform

    path, duration = sys.argv[1], float(sys.argv[2])
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 8
    with filiform.open(path, budget=1 << 20) as the_set:
        print(f"{hammer(the_set, duration, count)} rounds of {count} threads in {duration} s")
