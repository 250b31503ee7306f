"""Build backend of the package: maturin, with the program compiled for the wheel.

From the source distribution pip needs Rust only. `scripts/wheel.sh` compiles the program itself and does not come here.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import maturin
from maturin import get_requires_for_build_editable, get_requires_for_build_sdist, get_requires_for_build_wheel

HERE = Path(__file__).resolve().parent
#: Of the crate: in a source distribution this file is next to it.
CRATE = HERE if (HERE / "src" / "main.rs").exists() else HERE.parent
#: maturin puts what is here into the wheel.
SCRIPTS = HERE / "asperity.data" / "scripts"

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
]


def _program() -> None:
    # Where maturin compiles the module, whose features of the dependencies are the same: both take one compilation.
    target = Path(os.environ.get("CARGO_TARGET_DIR", CRATE / "target"))
    # A source distribution leaves out the benchmarks' package, so that cargo removes entries of Cargo.lock, which --locked forbids; the
    # versions of all others remain.
    locked = [] if CRATE == HERE else ["--locked"]
    packages = ["-p", "asperity", "-p", "asperity-python", "--bin", "asperity"]
    subprocess.run(["cargo", "build", "--release", *locked, *packages, "--target-dir", target], cwd=CRATE, check=True)
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    shutil.copy(target / "release" / "asperity", SCRIPTS / "asperity")
    # Symbols would triple the size of the wheel.
    if strip := shutil.which("strip"):
        subprocess.run([strip, SCRIPTS / "asperity"], check=True)


def build_wheel(*arguments: Any, **options: Any) -> str:
    _program()
    return str(maturin.build_wheel(*arguments, **options))


def build_editable(*arguments: Any, **options: Any) -> str:
    _program()
    return str(maturin.build_editable(*arguments, **options))


def build_sdist(*arguments: Any, **options: Any) -> str:
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return str(maturin.build_sdist(*arguments, **options))
