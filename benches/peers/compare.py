#!/usr/bin/env python3
"""Runs asperity, Tamaas and ContactMechanics alternately on the same heights, one thread each, and compares cost and result.

    benches/peers/compare.py [--quick] [--repeats N] [--case NAME] [--core N] [--json FILE] [--asperity PROGRAM]

The peers are installed from PyPI, in the versions of requirements.txt, into target/peers/venv; heights and fields are in
target/peers. Times and memory are those of whole processes as reported by the kernel, reading and writing included. The tools' own
error estimates are not used: evaluate.py evaluates every pressure field. Needs Python 3.11 or newer on Linux.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK = ROOT / "target" / "peers"
PYTHON = WORK / "venv" / "bin" / "python"
ASPERITY, TAMAAS, CONTACTMECHANICS = "asperity", "Tamaas", "ContactMechanics"
PEERS = (TAMAAS, CONTACTMECHANICS)
SCRIPTS = {TAMAAS: "tamaas_run.py", CONTACTMECHANICS: "contactmechanics_run.py"}

# Tamaas at this tolerance is the reference. At 1e-12 it had not stopped after 20 000 iterations at 512².
TIGHT = 1e-9

# Limits for the evaluated fields; a run that misses one is marked.
MATCHED = {"complementarity": 1e-8}
PHYSICAL = {"energy_difference": 1e-6, "area_difference": 1e-3}


@dataclass(frozen=True)
class Case:
    """One surface under one load. Tolerances are per tool, each as the tool defines it: the loosest one or three times a power
    of ten that meets the limits on the grid of the case."""

    name: str
    points: int
    cut_off: float
    load: float
    limits: dict
    tolerances: dict
    flags: tuple = ()


CASES = (
    Case(
        "challenge, complementarity 1e-8", 2048, 1 / 1000, 0.01, MATCHED,
        {ASPERITY: 1e-6, TAMAAS: 3e-8, CONTACTMECHANICS: 1e-7},
    ),
    Case(
        "challenge, energy 1e-6 and area 0.1 %", 2048, 1 / 1000, 0.01, PHYSICAL,
        {ASPERITY: 3e-2, TAMAAS: 1e-4, CONTACTMECHANICS: 1e-4},
        ("--precision", "f32"),
    ),
    Case(
        "reduced, complementarity 1e-8", 1024, 1 / 64, 0.3, MATCHED,
        {ASPERITY: 1e-8, TAMAAS: 1e-7, CONTACTMECHANICS: 1e-7},
    ),
)


def arguments():
    a = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    a.add_argument("--quick", action="store_true", help="512 x 512 points: minutes instead of half an hour")
    a.add_argument("--repeats", type=int, default=1, help="number of rounds; medians are reported")
    a.add_argument("--case", action="append", help="only cases whose name contains this text")
    a.add_argument("--core", type=int, help="processor for all runs; default: the last one")
    a.add_argument("--json", type=Path, help="write all measurements here")
    a.add_argument("--asperity", type=Path, default=ROOT / "target" / "release" / "asperity", help="the program")
    given = a.parse_args()
    if given.repeats < 1:
        a.error(f"--repeats = {given.repeats}; accepted: 1 or more")
    if not given.asperity.is_file():
        a.error(f"--asperity = {given.asperity} (no such file); `cargo build --release` builds it")
    return given


def install():
    """Creates the virtual environment, unless it exists with exactly these versions."""
    wanted = (HERE / "requirements.txt").read_text()
    stamp = WORK / "venv" / "installed.txt"
    if stamp.exists() and stamp.read_text() == wanted:
        return
    print("installing the peers into target/peers/venv", file=sys.stderr)
    WORK.mkdir(parents=True, exist_ok=True)
    subprocess.run([sys.executable, "-m", "venv", "--clear", WORK / "venv"], check=True)
    subprocess.run([PYTHON, "-m", "pip", "install", "-q", "-r", HERE / "requirements.txt"], check=True)
    stamp.write_text(wanted)


def measured(command):
    """Runs a command; its JSON, wall and processor time, and peak memory.

    The kernel initialises a child's peak memory with that of its parent, so this program does not import numpy.
    """
    clock = time.perf_counter()
    child = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, text=True)
    output = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.perf_counter() - clock
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"exit status {child.returncode}: {' '.join(str(c) for c in command)}")
    return dict(
        wall=wall,
        cpu=usage.ru_utime + usage.ru_stime,
        rss=usage.ru_maxrss * 1024,
        output=json.loads(output.splitlines()[-1]),
    )


def heights(asperity, case, points):
    file = WORK / f"heights-{points}-{round(1 / case.cut_off)}.npy"
    command = [asperity, "surface", "--grid", points, "--length", "1um", "--hurst", 0.8, "--roll-off", "0.2um"]
    command += ["--cut-off", f"{case.cut_off}um", "--rms-gradient", 1, "--seed", 1, "--out", file, "--json"]
    measured(command)
    return file


def run(tool, asperity, case, file, tolerance):
    """One run: its measurements and the path of its field."""
    if tool == ASPERITY:
        out = WORK / "asperity"
        shutil.rmtree(out, ignore_errors=True)
        command = [asperity, "solve", "--heights", file, "--pressure", case.load, "--tolerance", tolerance, *case.flags]
        command += ["--out", out, "--json", "--threads", 1]
    else:
        out = WORK / f"{tool}-{tolerance}.npy"
        command = [PYTHON, HERE / SCRIPTS[tool], file, case.load, tolerance, out]
    print(f"  {tool}, tolerance {tolerance:.0e} …", file=sys.stderr, flush=True)
    found = measured(command)
    found["solver_cpu"] = found["output"]["cpu_seconds"]
    print(f"  {tool}: {found['cpu']:.2f} CPU s, {found['wall']:.2f} s", file=sys.stderr, flush=True)
    return found, out


def evaluate(file, load, field, reference):
    return measured([PYTHON, HERE / "evaluate.py", file, load, field, reference])["output"]


def compare(given, case, references):
    """All tools on one case: medians of the rounds, evaluated fields."""
    points = 512 if given.quick else case.points
    print(f"{case.name}, {points}², p = {case.load} E*", file=sys.stderr)
    file = heights(given.asperity, case, points)
    key = (file, case.load)
    if key not in references:
        # Reused: the tight tolerance takes longest, and two cases share the reference.
        field = run(TAMAAS, given.asperity, case, file, TIGHT)[1]
        references[key] = field.rename(WORK / f"reference-{file.stem}.npy")
    rounds = {tool: [] for tool in (ASPERITY, *PEERS)}
    evaluated = {}
    for _ in range(given.repeats):
        for tool in PEERS:
            # One run of asperity, which is much shorter, between any two runs of the peers.
            for one in (ASPERITY, tool):
                found, field = run(one, given.asperity, case, file, case.tolerances[one])
                evaluated[one] = evaluate(file, case.load, field, references[key])
                rounds[one].append(found)
    middle = lambda tool, key: statistics.median(r[key] for r in rounds[tool])
    lines = {
        tool: dict(
            {key: middle(tool, key) for key in ("cpu", "solver_cpu", "wall", "rss")},
            tolerance=case.tolerances[tool],
            missed=[key for key, limit in case.limits.items() if not evaluated[tool][key] <= limit],
            **evaluated[tool],
        )
        for tool in rounds
    }
    return dict(case=case.name, points=points, load=case.load, tools=lines)


def table(rows):
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for n, row in enumerate(rows):
        print("| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths)) + " |")
        if n == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")


def print_result(result):
    """As Markdown, for the documents."""
    print(f"\n{result['case']}: {result['points']}², p = {result['load']} E*\n")
    tools = result["tools"]
    ours = tools[ASPERITY]
    head = ("tool", "tolerance", "CPU / s", "solver alone / s", "wall / s", "peak / MB", "CPU ratio", "wall ratio", "memory ratio")
    rows = [head]
    for tool, line in tools.items():
        ratios = [f"{line[key] / ours[key]:.3g}" for key in ("cpu", "wall", "rss")]
        times = [f"{line[key]:.2f}" for key in ("cpu", "solver_cpu", "wall")]
        rows.append((tool, f"{line['tolerance']:.0e}", *times, f"{line['rss'] / 1e6:.0f}", *ratios))
    table(rows)
    print()
    quality = ("complementarity", "penetration", "load_error", "area_difference", "gap_difference", "energy_difference")
    rows = [("tool", "area", "mean gap", "pixels that differ", *(q.replace("_", " ") for q in quality), "limits")]
    for tool, line in tools.items():
        limits = "missed: " + ", ".join(m.replace("_", " ") for m in line["missed"]) if line["missed"] else "met"
        numbers = [f"{line[q]:.1e}" for q in quality]
        rows.append((tool, f"{line['area']:.6f}", f"{line['mean_gap']:.9f}", str(line["pixels"]), *numbers, limits))
    table(rows)


def main():
    given = arguments()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
        os.environ[name] = "1"
    install()
    core = max(os.sched_getaffinity(0)) if given.core is None else given.core
    os.sched_setaffinity(0, {core})
    references, results = {}, []
    for case in CASES:
        if not given.case or any(word in case.name for word in given.case):
            results.append(compare(given, case, references))
            print_result(results[-1])
            sys.stdout.flush()
            if given.json:
                given.json.write_text(json.dumps(results, indent=1) + "\n")
    load = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"\ndifferences are relative to Tamaas at {TIGHT:.0e}; load averages at the end: {load}; one thread on processor {core}")


if __name__ == "__main__":
    main()
