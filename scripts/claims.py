#!/usr/bin/env python3
"""Repeats the commands behind the numbers in the documents and compares.

evidence/claims.toml lists runs (a command and its cost) and claims (a quotation of a document, the run behind it, and how its numbers
follow from the run's output). A claim holds if its quotation stands in the document, the document names the command, and every number
in braces equals the run's within its tolerance: half a unit of its last printed digit where none is given.

    scripts/claims.py --asperity target/release/asperity               # runs of seconds and minutes
    scripts/claims.py --asperity target/release/asperity --cost seconds
    scripts/claims.py --asperity target/release/asperity --all         # hours

Exit code 1 if a claim does not hold, 2 for a damaged table. Python 3.11 or newer; no packages.
"""

import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COSTS = ["seconds", "minutes", "hours"]
RUN_KEYS = {"command", "cost", "stated", "needs"}
CLAIM_KEYS = {"run", "document", "quote", "values", "tolerance", "output", "keys", "holds", "unstated"}
SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
NUMBER = re.compile(r"([+-]?[\d ]*\.?\d+)(?:e([+-]?\d+)|[·×]10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?$")


class Damaged(Exception):
    """The table of claims is wrong, not a number."""


def spaces(text):
    """Line breaks of a document are spaces in a quotation."""
    return re.sub(r"\s+", " ", text).strip()


def printed(text):
    """Value of a printed number, and half a unit of its last digit."""
    found = NUMBER.match(text.strip().replace("−", "-"))
    if not found:
        raise Damaged(f"{{{text}}} is no number")
    mantissa = found[1].replace(" ", "")
    exponent = int(found[2] or (found[3] or "0").translate(SUPERSCRIPTS))
    decimals = len(mantissa.partition(".")[2])
    return float(mantissa) * 10.0**exponent, 0.5 * 10.0 ** (exponent - decimals)


class Finished:
    """What a run left; its attributes are the names that `values` may use."""

    def __init__(self, folder, code, out, err):
        self.folder, self.code, self.out, self.err = folder, code, out, err
        self.files = {}

    def load(self, name="results.json"):
        """A JSON file of the run's folder; without a name the results of `run`."""
        if name not in self.files:
            self.files[name] = json.loads((self.folder / name).read_text())
        return self.files[name]

    def rows(self, name):
        return list(csv.DictReader((self.folder / name).open()))

    def line(self, k=0):
        """Line k of standard output, as JSON."""
        return json.loads(self.out.splitlines()[k])

    def find(self, pattern, text=None):
        """Numbers in the groups of a regular expression, from a text, by default standard output."""
        found = re.search(pattern, self.out if text is None else text)
        if not found:
            raise LookupError(f"no {pattern!r} in the output")
        return [float(g.replace("−", "-")) for g in found.groups()]

    def names(self):
        names = {name: getattr(self, name) for name in ["code", "out", "err", "load", "rows", "line", "find"]}
        return names | {"math": math, "len": len, "min": min, "max": max, "abs": abs, "sum": sum, "float": float, "all": all, "sorted": sorted}


def read_table(path):
    table = tomllib.loads(path.read_text())
    runs, claims = table["run"], table["claim"]
    for name, run in runs.items():
        if set(run) - RUN_KEYS or run.get("cost") not in COSTS or "command" not in run:
            raise Damaged(f"run {name}: keys {sorted(RUN_KEYS)}, cost one of {COSTS}")
    for claim in claims:
        if set(claim) - CLAIM_KEYS or claim.get("run") not in runs or len({"values", "output", "keys", "holds"} & set(claim)) != 1:
            raise Damaged(f"claim {claim}: keys {sorted(CLAIM_KEYS)}, a run of the table, and one of values, output, keys and holds")
    return runs, claims


def execute(command, scratch):
    """Runs the commands of a run in the repository; `$OUT` is its folder."""
    folder = Path(tempfile.mkdtemp(dir=scratch))
    environment = os.environ | {"OUT": str(folder), "PATH": f"{scratch / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    return Finished(folder, done.returncode, done.stdout, done.stderr)


def read_document(claim):
    """The text of a document, or of all that a pattern names."""
    return "\n".join(file.read_text() for file in sorted(ROOT.glob(claim["document"])))


def in_document(claim, run, documents):
    """What is wrong with the document's side of a claim, without running anything."""
    text = documents.setdefault(claim["document"], spaces(read_document(claim)))
    wrong = []
    if "quote" in claim and spaces(re.sub(r"\{([^}]*)\}", r"\1", claim["quote"])) not in text:
        wrong.append("the quotation does not stand in the document")
    stated = run.get("stated", run["command"])
    if not claim.get("unstated") and spaces(stated) not in text:
        wrong.append(f"the document does not name the command: {stated}")
    return wrong


def keys_of(value):
    """All keys of a JSON value."""
    if isinstance(value, dict):
        return set(value).union(*map(keys_of, value.values()))
    return set().union(*map(keys_of, value)) if isinstance(value, list) else set()


def compare(claim, finished):
    """What differs between a claim and the run's output, and the number of compared numbers."""
    if "output" in claim:
        document, out = read_document(claim), finished.out
        if finished.code:
            return [f"exit code {finished.code}: {finished.err.strip()[-300:]}"], 1
        holds = {"equal": document == out, "contained": out.strip() in document}[claim["output"]]
        return [] if holds else ["the document and the output differ"], 1
    if "keys" in claim:
        code = " ".join(re.findall(r"`([^`]*)`", read_document(claim)))
        keys = keys_of(finished.load(claim["keys"]))
        absent = sorted(key for key in keys if not re.search(rf"(?<!\w){re.escape(key)}(?!\w)", code))
        return ([f"the document lacks {', '.join(absent)}"] if absent else []), len(keys)
    braces = re.findall(r"\{([^}]*)\}", claim["quote"])
    try:
        computed = eval(claim.get("values", claim.get("holds")), {"__builtins__": {}} | finished.names())  # noqa: S307: expressions of this repository
    except Exception as error:  # what a failed run lacks takes many forms
        return [f"{type(error).__name__}: {error}; exit code {finished.code}: {finished.err.strip()[-300:]}"], 1
    if "holds" in claim:
        return ([] if computed is True else [f"{claim['holds']} is {computed}"]), 1
    computed = computed if isinstance(computed, list) else [computed]
    if len(braces) != len(computed):
        raise Damaged(f"{len(braces)} numbers in braces, {len(computed)} values: {claim['quote']}")
    wrong = []
    for text, value in zip(braces, computed):
        expected, half = printed(text)
        tolerance = claim.get("tolerance", half)
        if isinstance(tolerance, str):
            tolerance = float(tolerance.removesuffix("%")) / 100 * abs(expected)
        # Rounding of the decimal representation.
        if value is None or not abs(value - expected) <= tolerance * (1 + 1e-6) + 1e-12 * abs(expected):
            wrong.append(f"{text} is now {value if value is None else format(value, '.7g')}")
    return wrong, len(braces)


def test_names():
    """Tests that the documents name and that do not exist. A name is the start of a path of modules and functions."""
    defined, modules = set(), set()
    for file in [file for folder in ["src", "crates", "tests"] for file in ROOT.glob(f"{folder}/**/*.rs")]:
        defined |= set(re.findall(r"fn (\w+)", file.read_text()))
        modules |= {part.removesuffix(".rs") for part in file.relative_to(ROOT).parts}
    binaries = {path.stem for path in ROOT.glob("tests/*") if path.is_dir() or path.suffix == ".rs"}
    absent = []
    for document in sorted([*ROOT.glob("docs/*.md"), *ROOT.glob("docs/how-to/*.md"), *ROOT.glob("evidence/**/*.md")]):
        text = document.read_text()
        # `solvers analytic::hertz`, `--lib kernel`, `atoms::damage::…`, and the tables of asperities, fields, statistical.
        for found in re.finditer(r"`(?:--test )?(?:(--lib|%s) )?((?:[a-z]\w*::)*[a-z]\w*?)(?:…|_…)?`" % "|".join(sorted(binaries)), text):
            binary, path = found[1], found[2]
            if binary is None and not re.search(r"::[a-z]\w*_\w+$", path) or path.split("::")[-1] in {"NAME", "FILE"}:
                continue
            *_, last = path.split("::")
            if not any(name.startswith(last) or last in name for name in defined) and last not in modules:
                absent.append(f"{document.relative_to(ROOT)}: {found[0]}")
    return absent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", type=Path, default=ROOT / "target/release/asperity")
    parser.add_argument("--table", type=Path, default=ROOT / "evidence/claims.toml")
    parser.add_argument("--cost", choices=COSTS, default="minutes", help="most expensive runs")
    parser.add_argument("--all", action="store_true", help="as --cost hours")
    parser.add_argument("--run", help="this run only, whatever it costs")
    parser.add_argument("--without", default="", help="programs that are missing here, separated by commas: lammps")
    parser.add_argument("--quotations", action="store_true", help="only whether the quotations and commands stand in the documents")
    parser.add_argument("--names", action="store_true", help="only whether the tests that documents name exist")
    arguments = parser.parse_args()
    if arguments.names:
        absent = test_names()
        print("\n".join(["Tests that do not exist:", *absent] if absent else ["all tests that documents name exist"]))
        return 1 if absent else 0
    runs, claims = read_table(arguments.table)
    most = COSTS.index("hours" if arguments.all else arguments.cost)
    missing = set(filter(None, arguments.without.split(",")))
    documents, failed, numbers, left_out = {}, 0, 0, []
    with tempfile.TemporaryDirectory(prefix="claims-") as scratch:
        scratch = Path(scratch)
        # `asperity` in a command is the program under test.
        (scratch / "bin").mkdir()
        (scratch / "bin/asperity").symlink_to(arguments.asperity.absolute())
        for name, run in runs.items():
            own = [claim for claim in claims if claim["run"] == name]
            if not own:
                raise Damaged(f"run {name} has no claim")
            begun, finished = time.monotonic(), None
            if arguments.quotations:
                pass
            elif name == arguments.run if arguments.run else COSTS.index(run["cost"]) <= most and not missing & set(run.get("needs", [])):
                finished = execute(run["command"], scratch)
            else:
                left_out.append(f"{name} ({run['cost']}): {'; '.join(run['command'].strip().splitlines())}")
            faults = []
            for claim in own:
                wrong = in_document(claim, run, documents)
                if finished:
                    differs, count = compare(claim, finished)
                    wrong, numbers = wrong + differs, numbers + count
                faults += [f"{claim['document']}: {spaces(claim.get('quote', '(its whole text)'))[:160]}\n      {w}" for w in wrong]
            failed += len(faults)
            if finished or faults:
                spent = f"{time.monotonic() - begun:.1f} s" if finished else "not run"
                print(f"{'FAILED' if faults else 'holds'}  {name}: {len(own)} claims, {spent}", flush=True)
            for fault in faults:
                print(f"    {fault}", flush=True)
    if left_out and not arguments.run:
        print("Not run:\n" + "\n".join(f"    {line}" for line in left_out))
    print(f"{len(claims)} claims; {numbers} numbers and texts compared; {failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Damaged as error:
        print(f"evidence/claims.toml: {error}", file=sys.stderr)
        sys.exit(2)
