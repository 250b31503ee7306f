"""The documentation site; `make docs` builds it with the outputs of the tutorials, which test_tutorials.py runs."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import asperity

from conftest import REPOSITORY, needs


def test_the_site_has_no_warnings(tmp_path: Path) -> None:
    needs("python", all(map(importlib.util.find_spec, ("sphinx", "myst_nb", "furo"))))
    words = ["sphinx", "--fail-on-warning", "--keep-going", "--quiet", "-D", "nb_execution_mode=off"]
    folders = ["--doctree-dir", str(tmp_path / "doctrees"), str(REPOSITORY / "docs"), str(tmp_path / "site")]
    built = subprocess.run([sys.executable, "-P", "-m", *words, *folders], capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    page = (tmp_path / "site" / "reference-commands.html").read_text()
    assert "asperity atoms run" in page and "--dry-run" in page
    page = (tmp_path / "site" / "reference-python.html").read_text()
    for name in (*(name for name in asperity.__all__ if name != "__version__"), "Surface.from_array", "Run.contact_frame", "peers.compare"):
        assert f'id="asperity.{name}"' in page or f'id="asperity._errors.{name}"' in page, f"{name} is not in docs/reference-python.md"
    assert all((tmp_path / "site" / f"{page.stem}.html").exists() for page in (REPOSITORY / "docs").glob("*.md"))
