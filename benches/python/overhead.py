"""Time and memory of `asperity.solve` over those of the command line, on the same map, in turns.

usage: python overhead.py [NODES] [REPEATS]    with the wheel installed
"""

import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import asperity

PRESSURE = 0.01
CHILD = "import overhead; overhead.child()"


def processor(who):
    """Processor time so far of this process or of its ended children, s."""
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def child():
    """Solves the map of the first argument; prints time and peak memory, and those before the solve."""
    heights = np.load(sys.argv[1])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begin, used = time.perf_counter(), processor(resource.RUSAGE_SELF)
    surface = asperity.Surface.from_array(heights, 1.0, touching="low-points")
    state = asperity.solve(surface, 1.0, pressure=PRESSURE, progress=False)[0]
    seconds, used = time.perf_counter() - begin, processor(resource.RUSAGE_SELF) - used
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps({"seconds": seconds, "solve": state.seconds, "cpu": used, "before": before * 1024, "peak": peak * 1024}))


def program(path):
    """Wall and processor time of the command, and its own time of the load, s; its peak memory, bytes."""
    words = [asperity.program(), "solve", path, "--length", "1", "--modulus", "1", "--touching", "low-points"]
    begin, used = time.perf_counter(), processor(resource.RUSAGE_CHILDREN)
    with subprocess.Popen([*words, "--pressure", str(PRESSURE), "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as run:
        line = json.loads(run.stdout.readline())
    seconds, used = time.perf_counter() - begin, processor(resource.RUSAGE_CHILDREN) - used
    return {"seconds": seconds, "solve": line["seconds"], "cpu": used, "peak": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024}


def main():
    given = [int(a) for a in sys.argv[1:]]
    nodes, repeats = (given + [2048, 5][len(given) :])[:2]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "heights.npy"
        np.save(path, asperity.Surface.from_spectrum(nodes, seed=18).heights)
        command, module = [], []
        for _ in range(repeats):
            command.append(program(path))
            words = [sys.executable, "-W", "ignore", "-c", CHILD, path]
            found = subprocess.run(words, cwd=Path(__file__).parent, stdout=subprocess.PIPE, check=True)
            module.append(json.loads(found.stdout))
    ratios = [m["solve"] / c["solve"] for m, c in zip(module, command)]
    used = [m["cpu"] / c["cpu"] for m, c in zip(module, command)]
    # Standard error of the mean of the pairs.
    error = statistics.stdev(used) / len(used) ** 0.5 if len(used) > 1 else float("nan")
    median = lambda runs, key: statistics.median(run[key] for run in runs)
    map_bytes = 8 * nodes * nodes
    print(f"{nodes} x {nodes}, {repeats} runs in turns, median [extremes]")
    print(f"time of the load, module over command: {statistics.median(ratios):.3f} [{min(ratios):.3f}, {max(ratios):.3f}]")
    print(f"processor time of surface and solve, module over command: mean {statistics.mean(used):.3f} ± {error:.3f}, median {statistics.median(used):.3f}")
    print(f"processor time: module {median(module, 'cpu'):.2f} s, command {median(command, 'cpu'):.2f} s")
    print(f"module: surface and solve {median(module, 'seconds'):.2f} s, of which the load {median(module, 'solve'):.2f} s")
    print(f"command: {median(command, 'seconds'):.2f} s, of which the load {median(command, 'solve'):.2f} s")
    print(f"peak memory of the module beyond interpreter and map: {(median(module, 'peak') - median(module, 'before')) / map_bytes:.1f} maps")
    print(f"peak memory of the command: {command[0]['peak'] / map_bytes:.1f} maps")


if __name__ == "__main__":
    main()
