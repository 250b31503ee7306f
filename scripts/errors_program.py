"""Runs asperity for scripts/errors.py, and reads its results."""

import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

TIMEOUT = 240
# Of the residual, one after another: far below all errors here. Steps at small loads stop at the rounding of larger ones.
TOLERANCES = [1e-7, 1e-5, 1e-4]


class Failed(Exception):
    """The program refused, did not converge, or took too long."""


class Program:
    def __init__(self, path):
        self.path = str(Path(path).resolve())

    def run(self, arguments, folder, timeout=TIMEOUT):
        command = [self.path, *map(str, arguments)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=timeout)
        except subprocess.TimeoutExpired:
            raise Failed("timeout") from None
        if done.returncode:
            raise Failed(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else f"exit code {done.returncode}")
        return done

    def solve(self, heights, flags, timeout=TIMEOUT):
        """One `State` per load."""
        for tolerance in TOLERANCES:
            try:
                own = [] if "--tolerance" in flags else ["--tolerance", tolerance]
                return self.solved(heights, [*flags, *own], timeout)
            except Failed as e:
                if "rounding floor" not in str(e) or not own or tolerance == TOLERANCES[-1]:
                    raise
        raise AssertionError

    def solved(self, heights, flags, timeout):
        with scratch() as folder:
            np.save(folder / "h.npy", heights)
            arguments = ["solve", "h.npy", "--touching", "low-points", "--length", 1, "--modulus", 1, "--threads", 1, "--json", *flags]
            done = self.run(arguments, folder, timeout)
            lines = [json.loads(line) for line in done.stdout.splitlines()]
            pull_off = next((line for line in lines if "pull_off_pressure" in line), None)
            return [State(line, pull_off) for line in lines if line is not pull_off]

    def scene(self, text, heights, dry_run=False, timeout=TIMEOUT):
        """Results of `run` with this scene on a map, or its forecast, and the seconds that it took."""
        with scratch() as folder:
            if heights is not None:
                np.save(folder / "h.npy", heights)
            (folder / "scene.toml").write_text(text)
            start = time.monotonic()
            if dry_run:
                done = self.run(["run", "scene.toml", "--dry-run", "--json", "--threads", 1], folder, timeout)
                return json.loads(done.stdout.splitlines()[-1])
            self.run(["run", "scene.toml", "--out", "out", "--threads", 1], folder, timeout)
            results = json.loads((folder / "out" / "results.json").read_text())
            results["wall_seconds"] = time.monotonic() - start
            return results

    def forecast(self, heights, flags):
        with scratch() as folder:
            np.save(folder / "h.npy", heights)
            arguments = ["solve", "h.npy", "--touching", "low-points", "--length", 1, "--modulus", 1, "--threads", 1, "--json", "--dry-run"]
            return json.loads(self.run([*arguments, *flags], folder).stdout.splitlines()[-1])


class scratch:
    """A folder that is removed at the end."""

    def __enter__(self):
        self.path = Path(tempfile.mkdtemp(prefix="errors-"))
        return self.path

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)


class State:
    """A line of `solve --json`. Each quantity is (value, stated error or None)."""

    def __init__(self, line, pull_off=None):
        self.line, self.pull_off_line = line, pull_off

    @property
    def nodes(self):
        return self.line["contact_nodes"]

    @property
    def perimeter(self):
        return self.line["perimeter"]

    @property
    def pressure(self):
        return self.line["pressure"]

    @property
    def displacement(self):
        return self.line["displacement"]

    def number(self, key):
        return self.line.get(key), self.line.get(f"{key}_error")

    def contact_area(self):
        return self.number("contact_area")

    def mean_gap(self):
        return self.number("mean_gap")

    def stiffness(self):
        return self.number("stiffness")

    def extrapolated(self, key):
        entry = (self.line.get("extrapolated") or {}).get(key)
        return (entry["value"], entry["error"]) if entry else (None, None)

    def hydraulic_gap(self, axis):
        return self.number(f"hydraulic_gap_{axis}")

    def pull_off(self):
        line = self.pull_off_line or {}
        return line.get("pull_off_pressure"), line.get("pull_off_pressure_error")
