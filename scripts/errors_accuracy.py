"""`solve --error` against the truth, for scripts/errors.py.

A case is a random map of 256² or 512² points under a random load. It is solved with `--error` of each target; the truth is the same map on a
grid four times finer. The time of `--error` is compared with that of the cheapest plain solve, of all grids up to the map's own and of
tolerances from 1e-3 to 1e-8, whose results are within the target of the truth: what a full trade-off would find.
"""

import json
import math

import numpy as np

from errors_cases import energy_of_full_contact, log_uniform
from errors_program import Failed, scratch
from errors_surfaces import (
    Surface,
    band_limited,
    bump,
    interpolated,
    plateau_honed,
    self_affine,
    self_affine_modes,
    stepped,
    with_gradient,
)

TARGETS = [0.01, 0.03, 0.1, 0.3]
MAP_TARGETS = [0.1, 0.3]
MAPS = ["gap_map", "contact_map"]
QUANTITIES = ["contact_area", "mean_gap", "stiffness"]
FINER = 4
TOLERANCES = [1e-3, 1e-5, 1e-8]


def noisy(rng, points, gradient):
    """Self-affine down to eight points, with white noise as an instrument adds it."""
    smooth = self_affine_modes(rng, points, rng.uniform(0.6, 1.0), 0.25, 8 / points)
    noise = self_affine_modes(rng, points, -1.0, 0.0, 2 / points)
    power = [np.sum(np.abs(m) ** 2) for m in (smooth, noise)]
    noise *= math.sqrt(power[0] / power[1]) * log_uniform(rng, 1e-4, 1e-2)
    return Surface("noisy", points, modes=with_gradient(smooth + noise, gradient))


def surface(rng, points, gradient):
    # From two points to a fiftieth of the cell.
    shortest = log_uniform(rng, 2.0, 0.02 * points) / points
    hurst, roll_off = rng.uniform(0.3, 1.0), float(rng.choice([0.0, 0.25, 0.5]))
    kind = rng.choice(["self-affine", "anisotropic", "plateau", "noisy", "stepped", "bump"], p=[0.4, 0.15, 0.15, 0.1, 0.1, 0.1])
    if kind == "self-affine":
        return self_affine(rng, points, hurst, roll_off, shortest, gradient)
    if kind == "anisotropic":
        return self_affine(rng, points, hurst, roll_off, shortest, gradient, stretch=log_uniform(rng, 1.5, 4.0))
    if kind == "plateau":
        return plateau_honed(rng, points, max(shortest, 3 / points), gradient)
    if kind == "noisy":
        return noisy(rng, points, gradient)
    if kind == "stepped":
        return stepped(rng, points, gradient)
    smooth = bump(rng, points, gradient)
    return Surface(smooth.kind, points, modes=band_limited(smooth.heights(4 * points), points, 0.0))


class Case:
    def __init__(self, seed, index):
        rng = np.random.default_rng([seed, 105, index])
        self.points = int(rng.choice([256, 512], p=[0.6, 0.4]))
        gradient = log_uniform(rng, 0.03, 1.0)
        self.surface = surface(rng, self.points, gradient)
        self.heights = self.surface.heights(self.points)
        measured = self.surface.rms_gradient()
        self.load = log_uniform(rng, 1e-3, 0.5) * measured
        self.kind = str(rng.choice(["hard wall", "adhesion", "hardness", "layer"], p=[0.55, 0.15, 0.15, 0.15]))
        self.flags, self.of_truth = [], []
        if self.kind == "adhesion":
            gamma = energy_of_full_contact(self.heights) * log_uniform(rng, 0.003, 0.3)
            self.flags = ["--work-of-adhesion", gamma, "--range", log_uniform(rng, 1.4, 4.0) * math.sqrt(gamma / self.points)]
            self.of_truth = ["--resolution", "true"]
        elif self.kind == "hardness":
            hardness = measured * log_uniform(rng, 0.03, 1.0)
            self.flags, self.load = ["--hardness", hardness], min(self.load, 0.7 * hardness)
        elif self.kind == "layer":
            self.flags = ["--thickness", log_uniform(rng, 2 / self.points, 0.5), "--poisson", float(rng.choice([0.0, 0.3, 0.45]))]
        self.name = f"accuracy {seed}.{index}: {self.surface.kind} {self.points}², {self.kind}, p={self.load:.4g}"

    def on(self, n):
        """Heights on n² points: the waves that they hold."""
        if n >= self.points:
            return self.surface.heights(n)
        return interpolated(band_limited(self.heights, n, 0.0), n)


def deviations(line, truth):
    """Relative deviations from the truth, where both have the quantity."""
    pairs = {q: (line.get(q), truth.get(q)) for q in QUANTITIES}
    found = {q: abs(value / true - 1) for q, (value, true) in pairs.items() if value is not None and true}
    if truth["contact_area"] >= 1:
        found.pop("mean_gap", None)
    return found


def within(program, case, target):
    """Line of the state and line of the accuracy."""
    with scratch() as folder:
        np.save(folder / "h.npy", case.heights)
        arguments = ["solve", "h.npy", "--touching", "low-points", "--length", 1, "--modulus", 1, "--threads", 1, "--json", "--pressure", case.load]
        done = program.run([*arguments, *case.flags, "--error", target], folder)
        state, accuracy = (json.loads(line) for line in done.stdout.splitlines())
        return state, accuracy


def cheapest(program, case, truth, target):
    """Seconds of the cheapest plain solve within the target, if there is one."""
    best, n = None, case.points
    while n >= 32:
        found = False
        for tolerance in TOLERANCES:
            try:
                line = program.solve(case.on(n), [*case.flags, "--pressure", case.load, "--tolerance", tolerance])[0].line
            except Failed:
                continue
            if all(d <= target for d in deviations(line, truth).values()):
                best, found = min(best or math.inf, line["seconds"]), True
        if not found and best is not None:
            return best
        n //= 2
    return best


def fields_within(program, heights, flags):
    """Lines of a solve, and its gap."""
    with scratch() as folder:
        np.save(folder / "h.npy", heights)
        arguments = ["solve", "h.npy", "--touching", "low-points", "--length", 1, "--modulus", 1, "--threads", 1, "--json", "--out", "out"]
        done = program.run([*arguments, *flags], folder)
        return [json.loads(line) for line in done.stdout.splitlines()], np.load(folder / "out" / "gap.npy")


def map_records(program, case, load):
    """Errors of maps, stated and true at the nodes of the grid that `--error` ends with."""
    (_, *_), truth = fields_within(program, case.on(FINER * case.points), [*case.flags, *case.of_truth, *load])
    rms = float(np.std(case.heights))
    for target in MAP_TARGETS:
        asked = ",".join(f"{name}={target}" for name in MAPS)
        (state, accuracy), gap = fields_within(program, case.heights, [*case.flags, *load, "--error", asked])
        every = truth.shape[0] // gap.shape[0]
        there = truth[::every, ::every]
        touch, true_touch = gap <= 0, there <= 0
        union = np.count_nonzero(touch | true_touch)
        scale = max(state["mean_gap"], 0.01 * rms)
        found = {"gap_map": float(np.sqrt(np.mean((gap - there) ** 2))) / scale,
                 "contact_map": 1 - np.count_nonzero(touch & true_touch) / union if union else 0.0}
        stated = {name: accuracy["errors"].get(name) for name in MAPS}
        yield {"quantity": "accuracy of maps", "kind": f"{100 * target:g} %", "case": case.name, "met": accuracy["met"], "nodes": gap.shape[0],
               "deviations": found, "errors": stated}


def maps_line(records):
    """How often the stated errors of maps cover the truth, and whether it is 19 of 20."""
    own = [r for r in records if r["quantity"] == "accuracy of maps"]
    stated = {name: [r["deviations"][name] <= r["errors"][name] for r in own if r["errors"].get(name) is not None] for name in MAPS}
    shares = ", ".join(f"{name.replace('_', ' ')} {sum(covered)} of {len(covered)}" for name, covered in stated.items())
    kept = all(sum(covered) >= 0.95 * len(covered) for covered in stated.values())
    return f"Stated errors of maps, for targets of 10 and 30 %: {shares} cover the truth.", kept


def accuracy_records(program, seed, index):
    case = Case(seed, index)
    records = []
    try:
        load = ["--pressure", case.load]
        truth = program.solve(case.on(FINER * case.points), [*case.flags, *case.of_truth, *load])[0].line
        for target in TARGETS:
            state, accuracy = within(program, case, target)
            found = deviations(state, truth)
            worst = max(found.values())
            record = {"quantity": "accuracy", "kind": f"{100 * target:g} %", "case": case.name, "target": target, "met": accuracy["met"], "worst": worst,
                      "nodes": state["nx"], "seconds": accuracy["seconds"], "deviations": found, "errors": accuracy["errors"]}
            if accuracy["met"]:
                best = cheapest(program, case, truth, target)
                record["ratio"] = None if best is None else accuracy["seconds"] / best
            records.append(record)
        records += map_records(program, case, load)
    except Failed as e:
        records.append({"quantity": "accuracy", "kind": "failed", "case": case.name, "failed": str(e)})
    return records


def accuracy_table(records):
    """Markdown, and whether every target was kept, and every stated error covers the truth, in 19 of 20."""
    of_maps, maps_kept = maps_line(records)
    records = [r for r in records if r["quantity"] != "accuracy of maps"]
    lines = ["| target | maps | reached | within the target | largest deviation over it | time over the cheapest, median | not reached |", "|---|---|---|---|---|---|---|"]
    kept = True
    median = lambda values: sorted(values)[len(values) // 2] if values else None  # noqa: E731
    for target in TARGETS:
        own = [r for r in records if r.get("target") == target]
        met = [r for r in own if r["met"]]
        good = [r for r in met if r["worst"] <= target]
        ratio = median([r["ratio"] for r in met if r.get("ratio")])
        share = "–" if not met else f"{len(good)} of {len(met)}"
        worst = "–" if not met else f"{max(r['worst'] for r in met) / target:.2g}"
        lines.append(f"| {100 * target:g} % | {len(own)} | {len(met)} | {share} | {worst} | {'–' if ratio is None else f'{ratio:.2g}'} | {len(own) - len(met)} |")
    met = [r for r in records if r.get("met")]
    good = [r for r in met if r["worst"] <= r["target"]]
    ratios = [r["ratio"] for r in met if r.get("ratio")]
    if met:
        kept = len(good) >= 0.95 * len(met)
        stated = {q: [r["deviations"][q] <= r["errors"][q] for r in records if q in r.get("deviations", {}) and r["errors"].get(q) is not None] for q in QUANTITIES}
        kept &= all(sum(own) >= 0.95 * len(own) for own in stated.values())
        lines.append(f"| all | {len({r['case'] for r in records})} | {len(met)} | {len(good)} of {len(met)} | | {median(ratios):.2g} | |")
        shares = ", ".join(f"{q.replace('_', ' ')} {sum(own)} of {len(own)}" for q, own in stated.items())
        kept &= maps_kept
        lines += ["", f"Stated errors of all these results, with grids that leave out waves of the map: {shares} cover the truth.", "", of_maps]
    return lines, kept
