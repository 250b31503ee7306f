"""Forecasts of `solve --dry-run` and `run --dry-run` against what was needed, for scripts/errors.py.

A forecast of time states a factor, ten where it says no other ("an order of magnitude"): the ratio is the logarithm of measured over
forecast time, either way, over that of the factor. A forecast of memory is an upper bound: the ratio is that of the largest memory of the
process to the forecast plus what a very small problem needs; that of `solve` is in addition to the heights (8 bytes per point).
"""

import math

import numpy as np

from errors_cases import adhesive, log_uniform
from errors_program import Failed
from errors_surfaces import self_affine

FACTOR = 10.0


def logarithmic(measured, forecast, factor):
    return abs(math.log(max(measured, 1e-4) / max(forecast, 1e-4))) / math.log(factor)


def record(quantity, kind, name, ratio):
    return {"quantity": quantity, "kind": kind, "case": name, "value": 1.0 + ratio, "truth": 1.0, "error": 1.0, "residual": 0.0}


def random_heights(rng, n):
    return self_affine(rng, n, rng.uniform(0.3, 1.0), 0.25, float(rng.choice([2, 4, 8])) / n, log_uniform(rng, 0.05, 1.0))


def smallest(program):
    """Memory of the process with a very small problem, bytes."""
    bowl = np.linspace(-1, 1, 16)[:, None] ** 2 + np.linspace(-1, 1, 16) ** 2
    return program.solve(bowl, ["--pressure", 0.01])[0].line["peak_rss_bytes"]


def solve_records(program, seed, index):
    rng = np.random.default_rng([seed, 103, index])
    n = int(rng.choice([256, 512, 1024, 2048], p=[0.3, 0.4, 0.2, 0.1]))
    s = random_heights(rng, n)
    gradient = s.rms_gradient()
    loads = [gradient * log_uniform(rng, 1e-3, 0.3) for _ in range(rng.integers(1, 4))]
    flags = ["--pressure", ",".join(map(repr, sorted(loads)))]
    which = rng.choice(["hard", "adhesion", "hardness", "leakage", "f32", "gfmd"], p=[0.3, 0.2, 0.15, 0.15, 0.1, 0.1])
    if which == "adhesion":
        flags += [*adhesive(rng, s.heights(n), 1.5), "--resolution", "true"]
    elif which == "hardness":
        flags += ["--hardness", 0.5 * gradient]
    elif which == "leakage":
        flags += ["--leakage"]
    elif which == "f32":
        flags += ["--precision", "f32"]
    elif which == "gfmd":
        n = min(n, 256)
        s = random_heights(rng, n)
        flags += ["--method", "gfmd", "--tolerance", "1e-6"]
    name = f"forecast {seed}.{index}: solve {which} {n}², {len(loads)} loads"
    heights = s.heights(n)
    forecast = program.forecast(heights, flags)
    states = program.solve(heights, flags)
    seconds = sum(x.line.get("seconds", 0.0) for x in states)
    peak = max(x.line["peak_rss_bytes"] for x in states)
    found = [record("memory", "solve", name, peak / (forecast["bytes"] + 8 * n * n + smallest(program)))]
    stated = forecast.get("seconds")
    if stated is None:
        found.append({"quantity": "time", "kind": "solve", "case": name, "value": seconds, "truth": seconds, "error": None, "residual": 0.0})
    else:
        found.append(record("time", "solve", name, logarithmic(seconds, stated, forecast.get("seconds_factor", FACTOR))))
    return found


SCENE = """name = "forecast"
[surface]
grid = {grid}
seed = {seed}
hurst = {hurst}
roll_off_mode = {roll_off}
cut_off_mode = {cut_off}
[load]
p_star = {loads}
"""


def run_records(program, seed, index):
    rng = np.random.default_rng([seed, 104, index])
    n = int(rng.choice([256, 512, 1024], p=[0.5, 0.4, 0.1]))
    loads = sorted(log_uniform(rng, 1e-3, 0.3) for _ in range(rng.integers(1, 6)))
    cut_off = n / 2 / float(rng.choice([1, 2, 4]))
    text = SCENE.format(grid=n, seed=int(rng.integers(1, 10**6)), hurst=round(rng.uniform(0.3, 1.0), 2), roll_off=float(rng.choice([1, 4])), cut_off=cut_off, loads=loads)
    which = rng.choice(["hard", "adhesion", "unload", "layer", "leakage"])
    if which == "adhesion":
        text += '[adhesion]\nwork_of_adhesion = "50.0 mJ/m2"\nrange = "2.0 nm"\n'
    elif which == "unload":
        text = text.replace("[load]\n", "[load]\nunload = true\n") + '[continuum]\nhardness = "10.0 MPa"\n'
    elif which == "layer":
        text += '[continuum.layer]\nthickness = "10.0 um"\npoisson = 0.4\n'
    elif which == "leakage":
        text += "[continuum]\nleakage = true\n"
    name = f"forecast {seed}.{index}: run {which} {n}², {len(loads)} loads"
    forecast = program.scene(text, None, dry_run=True)
    results = program.scene(text, None)
    factor = forecast.get("seconds_factor", FACTOR)
    stages = results.get("stages") or []
    peak = max((x.get("peak_rss_bytes") or 0 for x in stages), default=0)
    return [
        record("time", "run", name, logarithmic(results["wall_seconds"], forecast["seconds"], factor)),
        record("memory", "run", name, peak / (forecast["bytes"] + smallest(program))),
    ]


def forecast_records(program, seed, index):
    name = f"forecast {seed}.{index}"
    kind = "run" if index % 2 else "solve"
    try:
        return (run_records if index % 2 else solve_records)(program, seed, index)
    except (Failed, KeyError) as e:
        return [{"quantity": q, "kind": kind, "case": name, "failed": repr(e)} for q in ("time", "memory")]
