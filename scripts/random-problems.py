#!/usr/bin/env python3
"""Solves random problems, and lists those that end without an answer or without a reason.

A problem is a random surface (self-affine of H from 0.1 to 1, white noise, anisotropic, honed, stepped, bumps, spikes, nearly flat; square,
oblong, small and odd sizes; heights over five decades), a body (half-space, layer, cubic crystal, not periodic), a wall, a law of adhesion,
a hardness, a precision, a method, and a path of one to three loads of any kind, some with unloading or pull-off.

Answers are: converged (exit code 0), refused with what is accepted (2), a reason (3: the surfaces separate, the rounding floor of the
precision). Failures are: the limit of iterations and all other reasons, a panic, a signal, more seconds than --limit. At loads on single
points `gfmd` may reach the limit (evidence/extremes.md).

    scripts/random-problems.py --asperity target/release/asperity                       # 500 problems, some minutes on two cores
    scripts/random-problems.py --asperity target/release/asperity --seed 7 --only 312   # one of them, with its command
    scripts/random-problems.py --asperity target/release/asperity --compare OLD         # processor time and iterations of another program

Exit code 1 after a failure. Needs numpy: that of `make test`, in target/python, is used where the interpreter has none.
"""

import argparse
import collections
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from multiprocessing import Pool
from pathlib import Path

sys.dont_write_bytecode = True
import numpy_found  # noqa: E402, F401
import numpy as np  # noqa: E402
from errors_cases import log_uniform  # noqa: E402
from errors_surfaces import band_limited, bump, interpolated, plateau_honed, self_affine, stepped  # noqa: E402

REASON = re.compile(r"rounding floor|detached|separat")


def heights_of(rng):
    """A map and its rms gradient on a cell of extent 1 along x with square pixels."""
    n = int(rng.choice([8, 12, 15, 16, 21, 24, 30, 32, 48, 50, 64, 81, 96, 128, 192]))
    base = 192 if n > 96 else 96
    kind = rng.choice(["self-affine", "anisotropic", "honed", "stepped", "bump", "white", "spikes", "flat"], p=[0.35, 0.1, 0.1, 0.12, 0.1, 0.1, 0.08, 0.05])
    if kind == "self-affine":
        h = self_affine(rng, base, rng.uniform(0.1, 1.0), float(rng.choice([0.0, 0.2, 0.5])), rng.choice([2, 4, 8]) / base, 1.0).heights(base)
    elif kind == "anisotropic":
        h = self_affine(rng, base, rng.uniform(0.3, 1.0), 0.0, 4 / base, 1.0, stretch=log_uniform(rng, 1.5, 6.0)).heights(base)
    elif kind == "honed":
        h = plateau_honed(rng, base, 4 / base, 1.0).heights(base)
    elif kind == "stepped":
        h = stepped(rng, base, 1.0).heights(base)
    elif kind == "bump":
        h = interpolated(band_limited(bump(rng, base, 1.0).heights(4 * base), base, 0.0), base)
    elif kind == "white":
        h = rng.standard_normal((base, base)) / base
    elif kind == "spikes":
        h = np.zeros((base, base))
        h[rng.integers(0, base, 5), rng.integers(0, base, 5)] = -rng.uniform(0.5, 2.0, 5) / base
    else:
        h = 1e-9 * rng.standard_normal((base, base))
    rows = int(rng.choice([n, max(4, n // 2), max(5, n // 3), min(base, 2 * n)], p=[0.6, 0.15, 0.1, 0.15]))
    h = h[:rows, :n] if rng.uniform() < 0.5 or kind in ("stepped", "spikes") else h[np.ix_(np.arange(rows) * base // rows, np.arange(n) * base // n)]
    h = np.ascontiguousarray(h - h.mean()) * log_uniform(rng, 1e-4, 1.0)
    gy, gx = ((np.roll(h, 1, a) - h) * n for a in (0, 1))
    return kind, h, float(np.sqrt((gx**2 + gy**2).mean())) or 1e-9


def loads(rng, kind, h, gradient):
    count = int(rng.choice([1, 1, 2, 3]))
    rms = float(h.std()) or 1e-9
    if kind == "pressure":
        return ["--pressure", ",".join(f"{p:.6g}" for p in sorted(log_uniform(rng, 1e-5, 3.0) * gradient for _ in range(count)))]
    if kind == "force":
        area = h.shape[0] / h.shape[1]
        return ["--force", ",".join(f"{p:.6g}" for p in sorted(log_uniform(rng, 1e-4, 1.0) * gradient * area for _ in range(count)))]
    if kind == "p-star":
        return ["--p-star", ",".join(f"{p:.6g}" for p in sorted(log_uniform(rng, 1e-5, 2.0) for _ in range(count)))]
    if kind == "contact":
        return ["--contact", ",".join(f"{p:.4g}" for p in sorted(log_uniform(rng, 2e-3, 0.95) for _ in range(count)))]
    if kind == "mean-gap":
        return ["--mean-gap", ",".join(f"{p:.6g}" for p in sorted((rms * log_uniform(rng, 0.02, 3.0) for _ in range(count)), reverse=True))]
    return ["--displacement", ",".join(f"{p:.6g}" for p in sorted(rms * log_uniform(rng, 0.02, 3.0) for _ in range(count)))]


def problem(seed, index):
    """Heights and flags of a problem."""
    rng = np.random.default_rng([seed, index])
    kind, h, gradient = heights_of(rng)
    flags, body = [], rng.choice(["half-space", "layer", "crystal", "non-periodic"], p=[0.55, 0.15, 0.1, 0.2])
    if body == "layer":
        flags += ["--thickness", log_uniform(rng, 0.003, 1.0), "--poisson", float(rng.choice([0.0, 0.3, 0.49, 0.5]))]
        flags += ["--base", "constant-stress"] if rng.uniform() < 0.3 else []
    elif body == "crystal":
        flags += ["--crystal", f"{rng.uniform(1.5, 4):.3f},{rng.uniform(0.5, 1.2):.3f},{rng.uniform(0.3, 2):.3f}"]
    elif body == "non-periodic":
        flags += ["--non-periodic"]
    with_law = rng.uniform() < 0.4
    if with_law:
        gamma = gradient * float(h.std()) * log_uniform(rng, 1e-4, 1.0) * 0.1
        spacing = 1 / h.shape[1]
        flags += ["--work-of-adhesion", gamma, "--range", log_uniform(rng, 0.3, 5.0) * np.sqrt(gamma * spacing), "--law", str(rng.choice(["exponential", "dugdale", "power-9-3"]))]
        if rng.uniform() < 0.3:
            flags += ["--resolution", "true"]
    elif rng.uniform() < 0.2:
        flags += ["--hardness", gradient * log_uniform(rng, 0.3, 5.0)]
    if rng.uniform() < 0.2:
        flags += ["--wall", "penalty", "--penalty-length", log_uniform(rng, 1e-4, 1.0) / h.shape[1]]
    if rng.uniform() < 0.3:
        flags += ["--precision", "f32"]
    flows = "--hardness" in flags
    kinds = ["pressure", "p-star", "force"]
    # What is refused: gaps of bodies that are not periodic or flow, contact fractions with adhesion or flow.
    kinds += ["mean-gap", "mean-gap", "displacement"] if not flows and body != "non-periodic" else []
    kinds += ["contact", "contact"] if not flows and not with_law else []
    load = rng.choice(kinds)
    if rng.uniform() < 0.3 and load not in ("mean-gap", "displacement") and body != "non-periodic":
        flags += ["--method", str(rng.choice(["gfmd", "bvm", "fast"]))]
    flags += loads(rng, load, h, gradient)
    if rng.uniform() < 0.2 and (with_law or flows):
        flags += ["--unload"]
    if with_law and body != "non-periodic" and "--method" not in flags and rng.uniform() < 0.3:
        flags += ["--pull-off"]
    return f"{kind} {h.shape[0]}x{h.shape[1]}, {body}", h, [str(f) for f in flags]


def solved(program, h, flags, limit):
    """Exit code, last line of messages, iterations, and processor seconds."""
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "h.npy", h)
        command = [program, "solve", "h.npy", "--touching", "low-points", "--length", "1", "--modulus", "1", "--threads", "1", "--json", *flags]
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        try:
            done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=limit)
        except subprocess.TimeoutExpired:
            return None, f"more than {limit:.0f} s", 0, time.monotonic() - start
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        errors = [line for line in done.stderr.splitlines() if not line.startswith("warning")]
        states = [json.loads(line) for line in done.stdout.splitlines()]
        iterations = sum(s.get("iterations", 0) for s in states)
        return done.returncode, (errors or [""])[-1], iterations, after.ru_utime - before.ru_utime


def measured(task):
    programs, seed, index, limit = task
    name, h, flags = problem(seed, index)
    return index, name, flags, [solved(p, h, flags, limit) for p in programs]


def fails(code, message, flags):
    if code == 3 and "gfmd" in flags and "iteration limit" in message:
        return False
    return code not in (0, 2, 3) or code == 3 and not REASON.search(message)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", required=True)
    parser.add_argument("--compare", help="another program; problems on which this one takes more than twice its processor time are listed")
    parser.add_argument("--problems", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="index of one problem: prints its command and messages, and keeps h.npy here")
    parser.add_argument("--verbose", action="store_true", help="print every problem that is not converged, with its reason")
    parser.add_argument("--limit", type=float, default=60, help="seconds for one problem")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    programs = [str(Path(p).resolve()) for p in (arguments.asperity, arguments.compare) if p]
    if arguments.only is not None:
        name, h, flags = problem(arguments.seed, arguments.only)
        np.save("h.npy", h)
        print(name)
        print("asperity solve h.npy --touching low-points --length 1 --modulus 1", *flags)
        code, message, *cost = solved(programs[0], h, flags, arguments.limit)
        print(code, message, *cost)
        return int(fails(code, message, flags))
    tasks = [(programs, arguments.seed, i, arguments.limit) for i in range(arguments.problems)]
    ends, reasons, failed, slow = collections.Counter(), collections.Counter(), [], []
    with Pool(arguments.jobs) as pool:
        for index, name, flags, results in pool.imap_unordered(measured, tasks):
            code, message, iterations, seconds = results[0]
            ends[code] += 1
            if code:
                reasons[code, re.sub(r"[-+]?\d[\d.e+-]*", "#", message)[:110]] += 1
            if code and arguments.verbose:
                print(f"{index}: {name}: {' '.join(flags)}: exit code {code}: {message}", flush=True)
            if fails(code, message, flags):
                failed.append((index, name, code, message))
                print(f"FAILED {index}: {name}: {' '.join(flags)}: exit code {code}: {message}", flush=True)
            if len(results) > 1 and seconds > 1.0 and seconds > 2 * results[1][3]:
                slow.append(index)
                print(f"SLOWER {index}: {name}: {seconds:.1f} s, {results[1][3]:.1f} s before; {iterations} iterations, {results[1][2]} before", flush=True)
    print(f"{arguments.problems} problems of seed {arguments.seed}: " + ", ".join(f"{n} with exit code {c}" for c, n in sorted(ends.items(), key=str)))
    for (code, reason), count in reasons.most_common():
        print(f"  {count} × {code}: {reason}")
    print(f"{len(failed)} failures" + (f", {len(slow)} more than twice as slow" if arguments.compare else ""))
    return 1 if failed or slow else 0


if __name__ == "__main__":
    sys.exit(main())
