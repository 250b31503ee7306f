"""Configuration of the documentation site: `make docs` builds it."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx import addnodes

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


_PAGES = Path(__file__).resolve().parent
_EVIDENCE = _PAGES.parent / "evidence"


def _relink(app: object, page: str, source: list[str]) -> None:
    """Links between docs/ and evidence/, which the site has as one tree; of other files of the repository their paths take the place of the links."""
    folder = _EVIDENCE.parent / page if page.startswith("evidence/") else _PAGES / page

    def target(found: re.Match[str]) -> str:
        label, path, anchor = found[1], found[2], found[3] or ""
        if "://" in path:
            return found[0]
        file = Path(os.path.normpath(folder.parent / path))
        for root, here in ((_PAGES, _PAGES), (_EVIDENCE, _PAGES / "evidence")):
            if file.is_relative_to(root) and not file.is_dir():
                return f"[{label}](/{here.relative_to(_PAGES) / file.relative_to(root)}{anchor})"
        return f"{label} (`{file.relative_to(_PAGES.parent)}`)"

    source[0] = re.sub(r"\[([^]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)", target, source[0])


def _name_pages(app: object, doctree: nodes.document) -> None:
    """Pages of evidence/ are read through a link of this folder, which Sphinx follows in references: they get their names in the site again."""
    for reference in doctree.findall(addnodes.pending_xref):
        page = Path(reference.get("reftarget", ""))
        if page.is_relative_to(_EVIDENCE):
            reference["reftarget"] = str("evidence" / page.relative_to(_EVIDENCE))


def setup(app: object) -> None:
    app.add_directive("program-help", ProgramHelp)  # type: ignore[attr-defined]
    app.connect("source-read", _relink)  # type: ignore[attr-defined]
    app.connect("doctree-read", _name_pages)  # type: ignore[attr-defined]
