#!/usr/bin/env python3
"""Compares the numbers of two result files key by key, through a map of renamed keys.

    scripts/compare-results.py OLD NEW [--map scripts/schema-3-to-4.json] [--tolerance 0]

OLD and NEW are JSON files of the same kind: results.json, tradeoff.json, or the lines of `asperity solve --json`. The map holds
{"keys": {old: new}}; of several that end a path the longest wins, and new may be a path ("../key": beside the parent). It may also hold
{"dimensions": {new key: [power of length, power of stress]}} of numbers that were in units of the cell and E* in OLD and are in SI in
NEW. Numbers are equal within a relative tolerance; 0 means the same bits. Times, memory and text are not compared. Exit code 1
where a number differs or is missing in NEW.
"""
import argparse
import json
import math
import re
import sys

MEASURED = re.compile(r"seconds|bytes|^stages$|^schema$|^threads$")
# Results of load paths; those below comparison are in units of the block of atoms.
REDUCED = ("continuum", "non_adhesive", "other_ranges", "cross_check", "methods", "comparison", "references")


def longest(table, path):
    """Value of the longest key of a table that ends a path, without indices of lists."""
    keys = [p for p in path if not p.isdigit()]
    for start in range(len(keys)):
        if (found := table.get(".".join(keys[start:]))) is not None:
            return found
    return None


def moved(path, renamed):
    """A path with its last key renamed."""
    new = longest(renamed, path)
    if new is None or path[-1].isdigit():
        return path
    path = path[:-1]
    while new.startswith("../"):
        new, path = new[3:], path[:-1]
    return path + tuple(new.split("."))


def numbers(value, path, renamed, found):
    """Collects every number of a JSON value by its path of keys and indices."""
    if isinstance(value, dict):
        for key, inner in value.items():
            below = moved(path + (key,), renamed)
            if not MEASURED.search(below[-1]):
                numbers(inner, below, renamed, found)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            numbers(inner, path + (str(i),), renamed, found)
    elif isinstance(value, (int, float)):
        found[path] = value


def units(data, path):
    """Length, m, and stress, Pa, of one unit of a reduced number."""
    if path[0] == "comparison":
        return data["atoms"]["length_angstrom"] * 1e-10, data["atoms"]["modulus_gpa"] * 1e9
    return data["scales"]["length_m"], data["scales"]["modulus_pa"]


def read(file, renamed, dimensions):
    text = open(file, encoding="utf-8").read()
    try:
        data = json.loads(text)
    except json.JSONDecodeError:
        data = [json.loads(line) for line in text.splitlines() if line.strip()]
    found = {}
    numbers(data, (), renamed, found)
    if isinstance(data, dict) and "scales" in data:
        for path in found:
            # The last place of a path distinguishes columns of rows.
            powers = longest(dimensions, path) or longest(dimensions, path[:-1] + (f"[{path[-1]}]",))
            if path[0] in REDUCED and powers:
                length, stress = units(data, path)
                found[path] *= length ** powers[0] * stress ** powers[1]
    return {".".join(path): value for path, value in found.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--map")
    parser.add_argument("--tolerance", type=float, default=0.0)
    args = parser.parse_args()
    table = json.load(open(args.map, encoding="utf-8")) if args.map else {}
    old, new = read(args.old, table.get("keys", {}), table.get("dimensions", {})), read(args.new, {}, {})
    missing = [path for path in old if path not in new]
    differ = [path for path in old if path in new and not math.isclose(old[path], new[path], rel_tol=args.tolerance)]
    for path in missing:
        print(f"missing: {path} = {old[path]}")
    for path in differ:
        print(f"differs: {path}: {old[path]} and {new[path]}")
    print(f"{len(old)} numbers: {len(old) - len(missing) - len(differ)} equal, {len(differ)} differ, {len(missing)} missing")
    sys.exit(bool(missing or differ))


main()
