"""Configuration of the documentation site: `make docs` builds it."""

from __future__ import annotations

import re
import shutil
from pathlib import PurePosixPath

from docutils import nodes
from docutils.parsers.rst import Directive

import asperity

project = "asperity"
author = "the authors of asperity"
release = version = asperity.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["scene.schema.json"]
html_theme = "furo"
html_title = f"asperity {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_copyright = False

# Headings are linked as the host of a repository links them.
myst_heading_anchors = 4

nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_excludepatterns = [] if shutil.which("lmp") or shutil.which("lammps") else ["tutorials/atoms.ipynb"]
nb_execution_show_tb = True
nb_merge_streams = True

# Pages that the program writes begin at the level at which others include them.
suppress_warnings = ["myst.header"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False


class ProgramHelp(Directive):
    """The help of the program and of its commands, which clap writes."""

    def run(self) -> list[nodes.Node]:
        return [self._section(words) for words in _commands()]

    def _section(self, words: list[str]) -> nodes.Node:
        title = " ".join(["asperity", *words])
        section = nodes.section(ids=[nodes.make_id(title)])
        section += nodes.title(text=title)
        section += nodes.literal_block(text=asperity.command(*words, "--help"), language="text")
        self.state.document.note_implicit_target(section, section)
        return section


def _commands(of: list[str] | None = None) -> list[list[str]]:
    """A command and those below it, as words."""
    words = of or []
    lines = asperity.command(*words, "--help").splitlines()
    if "Commands:" not in lines:
        return [words]
    listed = lines[lines.index("Commands:") + 1 :]
    listed = listed[: listed.index("")]
    names = [line.split()[0] for line in listed if line.startswith("  ") and line[2] != " "]
    return [words, *(found for name in names if name != "help" for found in _commands([*words, name]))]


def _name_files(app: object, page: str, source: list[str]) -> None:
    """Pages link to files of the repository outside this folder, which the site does not have: their paths take the place of the links."""
    depth = len(PurePosixPath(page).parents)
    outside = re.compile(r"\[([^]]+)\]\(" + depth * r"\.\./" + r"([^)#]+)(#[^)]*)?\)")
    source[0] = outside.sub(r"\1 (`\2`)", source[0])


def setup(app: object) -> None:
    app.add_directive("program-help", ProgramHelp)  # type: ignore[attr-defined]
    app.connect("source-read", _name_files)  # type: ignore[attr-defined]
