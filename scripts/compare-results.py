#!/usr/bin/env python3
"""Compares the numbers of two result files key by key, through a map of renamed keys.

    scripts/compare-results.py OLD NEW [--map scripts/schema-1-to-2.json] [--tolerance 0]

OLD and NEW are JSON files of the same kind: results.json, or the lines of `asperity solve --json`. The map holds
{"keys": {old: new}}; "parent.key" wins over "key". Numbers are equal within a relative tolerance; 0 means the same bits. Times,
memory and text are not compared. Exit code 1 where a number differs or is missing in NEW.
"""
import argparse
import json
import math
import re
import sys

MEASURED = re.compile(r"seconds|bytes|^stages$|^schema$|^threads$")


def numbers(value, path, renamed, found):
    """Collects every number of a JSON value by its path of keys and indices."""
    if isinstance(value, dict):
        for key, inner in value.items():
            parent = next((p for p in reversed(path) if not p.isdigit()), "")
            key = renamed.get(f"{parent}.{key}", renamed.get(key, key))
            if not MEASURED.search(key):
                numbers(inner, path + (key,), renamed, found)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            numbers(inner, path + (str(i),), renamed, found)
    elif isinstance(value, (int, float)):
        found[".".join(path)] = value


def read(file, renamed):
    text = open(file, encoding="utf-8").read()
    try:
        data = json.loads(text)
    except json.JSONDecodeError:
        data = [json.loads(line) for line in text.splitlines() if line.strip()]
    found = {}
    numbers(data, (), renamed, found)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--map")
    parser.add_argument("--tolerance", type=float, default=0.0)
    args = parser.parse_args()
    renamed = json.load(open(args.map, encoding="utf-8"))["keys"] if args.map else {}
    old, new = read(args.old, renamed), read(args.new, {})
    missing = [path for path in old if path not in new]
    differ = [path for path in old if path in new and not math.isclose(old[path], new[path], rel_tol=args.tolerance)]
    for path in missing:
        print(f"missing: {path} = {old[path]}")
    for path in differ:
        print(f"differs: {path}: {old[path]} and {new[path]}")
    print(f"{len(old)} numbers: {len(old) - len(missing) - len(differ)} equal, {len(differ)} differ, {len(missing)} missing")
    sys.exit(bool(missing or differ))


main()
