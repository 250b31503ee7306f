#!/usr/bin/env python3
"""Runs asperity, Tamaas and ContactMechanics on six problems, judges their fields independently, and writes evidence/judge.md.

    benches/judge/judge.py [--points N] [--seeds N] [--repeats N] [--problem NAME] [--asperity PROGRAM] [--write PAGE]

The peers are installed and started as by benches/peers/compare.py. Every run is a process of its own with one thread. Needs Python 3.11 or
newer on Linux.
"""

import argparse
import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "peers"))
import compare
from compare import ASPERITY, CONTACTMECHANICS, PEERS, PYTHON, ROOT, SCRIPTS, TAMAAS, measured

WORK = ROOT / "target" / "judge"
PROGRAMS = (ASPERITY, *PEERS)
# Violations of complementarity and of load to which all programs solve; a larger one is marked.
TARGET = 1e-8
# Processor seconds from which on a run is not repeated, and not made for the other surfaces.
ONCE, ONE_SURFACE = 10, 100


@dataclass(frozen=True)
class Problem:
    """Tolerances are those of PROGRAMS, each as the program defines it: the loosest one or three times a power of ten
    that meets the target, except that asperity's full contact is exact with any."""

    title: str
    load: float  # mean pressure over E*, or over that of full contact
    tolerances: tuple
    kind: str = "rough"
    law: str = "hard"  # or "free", without periodic images, or a hardness
    reference: str = "field"
    difference: str = "nodes; mean gap"


PROBLEMS = (
    Problem("Hard wall, p\\* = 0.01", 0.01, (1e-7, 1e-8, 1e-8)),
    Problem("Hard wall, p\\* = 0.1", 0.1, (3e-8, 1e-8, 1e-8)),
    Problem("Hardness 0.3 E\\*, p\\* = 0.05", 0.05, (1e-9, 1e-7, 1e-8), law="0.3"),
    Problem("Sphere without images", 0.036, (3e-7, 1e-8, 1e-8), "sphere", "free", "hertz", "Hertz: area; peak pressure"),
    Problem("Rough surface without images, p\\* = 0.05", 0.05, (3e-8, 1e-8, 1e-8), "rough", "free", "finer", "mean gap, finer grid"),
    Problem("Full contact, 1.001 times its pressure", 1.001, (1e-7, 1e-8, 1e-8), reference="full", difference="pressure, analytic"),
)


def arguments() -> argparse.Namespace:
    a = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    a.add_argument("--points", type=int, default=512, help="per side")
    a.add_argument("--seeds", type=int, default=3, help="number of rough surfaces")
    a.add_argument("--repeats", type=int, default=3, help="runs of each; the least time is taken")
    a.add_argument("--problem", action="append", help="only problems whose title contains this text")
    a.add_argument("--asperity", type=Path, default=ROOT / "target" / "release" / "asperity", help="the program")
    a.add_argument("--write", type=Path, help="write the page here; default: standard output")
    given = a.parse_args()
    if not given.asperity.is_file():
        a.error(f"--asperity = {given.asperity} (no such file); `cargo build --release` builds it")
    return given


def evaluator(*command: object) -> dict:
    return measured([PYTHON, HERE / "evaluator.py", *command])["output"]


def surface(kind: str, points: int, seed: int) -> tuple[Path, float]:
    """The file of heights, and the pressure of full contact."""
    file = WORK / f"{kind}-{points}-{seed}.npy"
    return file, evaluator("surface", kind, points, seed, file)["full_contact"]


def solve(asperity: Path, program: str, heights: Path, load: float, law: str, tolerance: float) -> tuple[dict, Path]:
    """One run: its measurements and the path of its field."""
    out = WORK / f"{program}.npy"
    if program == ASPERITY:
        out = WORK / "asperity"
        shutil.rmtree(out, ignore_errors=True)
        command = [asperity, "solve", heights, "--length", 1, "--modulus", 1, "--touching", "low-points", "--pressure", load]
        command += ["--tolerance", tolerance, "--threads", 1, "--json", "--out", out]
        command += {"hard": [], "free": ["--non-periodic"]}.get(law, ["--hardness", law])
    elif program == CONTACTMECHANICS and law not in ("hard", "free"):
        command = [PYTHON, HERE.parent / "peers" / "contactmechanics_hardness.py", heights, load, law, tolerance, out, tolerance]
    else:
        command = [PYTHON, HERE.parent / "peers" / SCRIPTS[program], heights, load, tolerance, out]
        command += {"hard": [], "free": ["non-periodic"]}.get(law, [law])
    run = measured(command)
    print(f"  {program}: {run['output']['cpu_seconds']:.2f} s", file=sys.stderr, flush=True)
    return run, out


def judge(heights: Path, load: float, law: str, program: str, field: Path, reference: object) -> dict:
    """Without images both operators judge: that of the program, and the other one under `other`."""
    if law != "free":
        return evaluator("judge", heights, load, law, field, reference)
    own, other = ("truncated", "love") if program == ASPERITY else ("love", "truncated")
    found = evaluator("judge", heights, load, own, field, reference)
    return found | dict(other=evaluator("judge", heights, load, other, field)["complementarity"])


def reference_of(given: argparse.Namespace, problem: Problem, heights: Path, load: float) -> object:
    """What the evaluator compares with: a field of a peer to a hundredth of the target, a mean gap on a finer grid, or a closed form."""
    if problem.reference == "field":
        peer, tight = (TAMAAS, TARGET / 100) if problem.law == "hard" else (CONTACTMECHANICS, TARGET / 10)
        return solve(given.asperity, peer, heights, load, problem.law, tight)[1].rename(WORK / "reference.npy")
    if problem.reference == "finer":
        finer = surface(problem.kind, 2 * given.points, 1)[0]
        field = solve(given.asperity, CONTACTMECHANICS, finer, load, problem.law, 10 * TARGET)[1]
        return evaluator("judge", finer, load, "love", field)["mean_gap"]
    return problem.reference


def runs_of(given: argparse.Namespace, problem: Problem) -> dict:
    """Of every program one row per surface: the numbers of the evaluator, and the least time of the repeats."""
    rows: dict = {program: [] for program in PROGRAMS}
    for seed in range(1, (given.seeds if problem.kind == "rough" else 1) + 1):
        print(f"{problem.title}, surface {seed}", file=sys.stderr, flush=True)
        heights, full = surface(problem.kind, given.points, seed)
        load = problem.load * (full if problem.reference == "full" else 1)
        # A finer grid takes longest, so one surface has it.
        reference = reference_of(given, problem, heights, load) if problem.reference != "finer" or seed == 1 else "none"
        best: dict = {}
        for _ in range(given.repeats):
            for program, tolerance in zip(PROGRAMS, problem.tolerances, strict=True):
                earlier = [row["seconds"] for row in rows[program]]
                if best.get(program, {"seconds": 0})["seconds"] > ONCE or (earlier and max(earlier) > ONE_SURFACE):
                    continue
                run, field = solve(given.asperity, program, heights, load, problem.law, tolerance)
                row = judge(heights, load, problem.law, program, field, reference)
                row |= dict(seconds=run["output"]["cpu_seconds"], rss=run["rss"], iterations=run["output"].get("iterations"))
                best[program] = min(best.get(program, row), row, key=lambda r: r["seconds"])
        for program, row in best.items():
            rows[program].append(row)
    return rows


def power(x: float) -> str:
    """Two digits, as the documents write them."""
    if x == 0 or 0.01 <= abs(x) < 1000:
        return f"{x:.0f}" if abs(x) >= 100 else f"{x:.2g}"
    digits, exponent = f"{x:.1e}".split("e")
    raised = "10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return raised if digits == "1.0" else f"{digits.removesuffix('.0')}·{raised}"


def scatter(values: list[float], digits: int) -> str:
    """Mean and standard deviation over the surfaces."""
    mean = f"{statistics.mean(values):.{digits}f}"
    return mean + (f" ± {statistics.stdev(values):.{digits}f}" if len(values) > 1 else "")


def differences(rows: list[dict]) -> str:
    """The largest of the surfaces."""
    found = [row["differences"] for row in rows if "differences" in row]
    names = [name for name in ("nodes", "area", "gap", "pressure") if name in found[0]]
    return "; ".join(power(max((row[name] for row in found), key=abs)).replace("-", "−") for name in names)


def table(problem: Problem, rows: dict) -> list[str]:
    free = problem.law == "free"
    head = ["program", "tolerance", "complementarity", *(["by the other operator"] if free else []), "load", "contact / %", "mean gap"]
    head += [problem.difference, "solve / s", "peak / MB", "iterations"]
    lines = [f"**{problem.title}**", "", "| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for (program, found), tolerance in zip(rows.items(), problem.tolerances, strict=True):
        worst = {key: max(row.get(key, 0) for row in found) for key in ("complementarity", "other", "load", "bounds", "rss")}
        violations = worst["complementarity"], max(worst["load"], worst["bounds"])
        judged, load = (power(x) + ("" if x <= TARGET else " (above)") for x in violations)
        cells = [program, power(tolerance), judged, *([power(worst["other"])] if free else []), load]
        cells += [scatter([100 * row["area"] for row in found], 3)]
        cells += [power(found[0]["mean_gap"]) if problem.reference == "full" else scatter([row["mean_gap"] for row in found], 6)]
        cells += [differences(found), scatter([row["seconds"] for row in found], 2), f"{worst['rss'] / 1e6:.0f}"]
        cells += [scatter([row["iterations"] for row in found], 0) if found[0]["iterations"] else "not given"]
        lines.append("| " + " | ".join(cells) + " |")
    return [*lines, ""]


def machine() -> str:
    cpu = next(line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name"))
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{cpu}, {os.cpu_count()} cores, {memory:.0f} GiB, Linux {platform.release().split('-')[0]}"


def versions(asperity: Path) -> str:
    ours = subprocess.run([asperity, "--version"], capture_output=True, text=True, check=True).stdout.split()[1]
    lines = (HERE.parent / "peers" / "requirements.txt").read_text().splitlines()
    peers = [line.replace("==", " ") for line in lines if "==" in line]
    return ", ".join([f"asperity {ours}", *peers, f"Python {platform.python_version()}"])


def page(given: argparse.Namespace, results: list[tuple[Problem, dict]]) -> str:
    text = (HERE / "page.md").read_text()
    values = dict(points=given.points, seeds=given.seeds, repeats=given.repeats, target=power(TARGET), once=ONCE, one=ONE_SURFACE)
    values |= dict(tables="\n".join(line for result in results for line in table(*result)).strip())
    values |= dict(finer=2 * given.points, versions=versions(given.asperity), machine=machine())
    values |= dict(load=", ".join(f"{x:.1f}" for x in os.getloadavg()))
    return text.format(**values)


def main() -> None:
    given = arguments()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
        os.environ[name] = "1"
    compare.install()
    WORK.mkdir(parents=True, exist_ok=True)
    chosen = [p for p in PROBLEMS if not given.problem or any(word in p.title for word in given.problem)]
    results = [(problem, runs_of(given, problem)) for problem in chosen]
    text = page(given, results)
    (WORK / "judge.json").write_text(json.dumps([dict(problem=p.title, rows=rows) for p, rows in results], indent=1) + "\n")
    if given.write:
        given.write.write_text(text)
    else:
        print(text)


if __name__ == "__main__":
    main()
