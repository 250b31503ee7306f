#!/usr/bin/env python3
"""Lists all tests with the first sentence of their comment, or their name as words.

    scripts/list_tests.py --write evidence/tests.md      # as `make docs` does
"""

import argparse
import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
#: A function in Rust with its comment and attributes, of which one is `#[test]`.
TEST = re.compile(r"((?:^ *///.*\n)*)((?:^ *#\[.*\]\n)*^ *#\[test\]\n(?:^ *#\[.*\]\n)*)^ *(?:async )?fn (\w+)", re.MULTILINE)

PAGE = """# Tests

{count} tests: their names, and the first sentence of their comments, or the name as words. `scripts/list_tests.py` writes this page (`make docs`).
What they found is in [validation](validation.md). Tests in `tests/` run by `cargo test --test FOLDER`, those of crates by `cargo test -p CRATE`,
those in Python by `scripts/test-python.sh`.
{groups}"""


def statement(comment, name):
    """First sentence of a comment, in one line of a table."""
    first = re.split(r"(?<=[.:;])(?<!et al\.)(?<!sec\.)(?<!eq\.)\s", " ".join(comment.split()))[0] if comment else name.removeprefix("test_").replace("_", " ")
    return first.rstrip(".:;").replace("|", "\\|")


def rust(file):
    text = file.read_text()
    for comment, _, name in TEST.findall(text):
        yield name, statement(re.sub(r"^ *///", "", comment, flags=re.MULTILINE), name)


def python(file):
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node.name, statement(ast.get_docstring(node), node.name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, required=True)
    files = [(file, rust) for folder in ("src", "crates", "tests") for file in sorted(ROOT.glob(f"{folder}/**/*.rs"))]
    files += [(file, python) for file in sorted(ROOT.glob("python/tests/test_*.py"))]
    groups, count = [], 0
    for file, read in files:
        rows = [f"| `{name}` | {text} |" for name, text in read(file)]
        count += len(rows)
        if rows:
            groups.append("\n".join(["", f"## `{file.relative_to(ROOT)}`", "", "| test | statement |", "|---|---|", *rows, ""]))
    parser.parse_args().write.write_text(PAGE.format(count=count, groups="".join(groups)))


if __name__ == "__main__":
    main()
