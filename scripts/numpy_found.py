"""Numpy for scripts: that of the interpreter, else that of `make test` in target/python, by which the script is executed anew."""

import os
import sys
from pathlib import Path

MARK = "NUMPY_REEXECUTED"

try:
    import numpy  # noqa: F401
except ImportError:
    other = Path(__file__).resolve().parent.parent / "target/python/bin/python"
    if not other.exists() or os.environ.get(MARK):
        sys.exit(f"{Path(sys.argv[0]).name}: numpy is missing (scripts/setup.sh --tests installs it in target/python)")
    os.environ[MARK] = "1"
    os.execv(other, [str(other), *sys.argv])
