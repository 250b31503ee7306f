"""The documents: their length, their links, and the commands and lines that they show."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import asperity

from conftest import REPOSITORY

#: Words of all pages for users that are written by hand, of one of them, of a how-to page, of the README and of the page for referees.
ALL_WORDS, PAGE_WORDS, HOW_TO_WORDS, README_WORDS, TRUST_WORDS = 25_000, 1_200, 400, 900, 800

#: Words of a paragraph or item, and characters of a line of text.
PARAGRAPH_WORDS, LINE_CHARACTERS = 90, 100

DOCS = REPOSITORY / "docs"
README = REPOSITORY / "README.md"
PAGES = sorted([*DOCS.glob("*.md"), *DOCS.glob("how-to/*.md")])
GENERATED = [DOCS / "keys.md", DOCS / "result-keys.md"]
WRITTEN = [page for page in PAGES if page not in GENERATED]
TUTORIALS = sorted(DOCS.glob("tutorials/*.ipynb"))
EVIDENCE = sorted((REPOSITORY / "evidence").glob("**/*.md"))
OTHERS = [README, *(REPOSITORY / name for name in ("CONTRIBUTING.md", "potentials/README.md", "lammps-inputs/README.md"))]


def name(page: Path) -> str:
    return str(page.relative_to(REPOSITORY))


def text_of(page: Path) -> str:
    """A page, or the text of a notebook."""
    if page.suffix == ".ipynb":
        cells = json.loads(page.read_text())["cells"]
        return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return page.read_text()


def by_hand(text: str) -> str:
    return re.sub(r"<!-- generated.*?<!-- end of generated -->", "", text, flags=re.DOTALL)


def words(text: str) -> int:
    """Words written by hand: what has a letter or digit. Targets of links and rules of tables are no words."""
    text = re.sub(r"\]\([^)]*\)", "]", by_hand(text))
    return sum(any(c.isalnum() for c in word) for word in text.split())


def without_code(text: str) -> str:
    return re.sub(r"^ *```.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE)


def paragraphs(text: str) -> Iterator[str]:
    """Paragraphs and items of lists, without code, tables and headings."""
    lines: list[str] = []
    for line in [*without_code(by_hand(text)).splitlines(), ""]:
        ends = not line.strip() or re.match(r"\s*([-*]|\d+\.) |#|\s*\||\s*<", line)
        if ends and lines:
            yield " ".join(lines)
            lines = []
        if line.strip() and not re.match(r"#|\s*\||\s*<|    \S", line):
            lines.append(line.strip())


def anchors(page: Path) -> set[str]:
    """Names that a host of repositories gives to headings."""
    headings = re.findall(r"^#{1,6} (.*)$", without_code(page.read_text()), flags=re.MULTILINE)
    plain = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in headings)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in plain}


def dead_links(page: Path) -> list[str]:
    dead = []
    for path, anchor in re.findall(r"\]\(([^)\s#]*)(?:#([^)\s]*))?\)", without_code(text_of(page))):
        if "://" in path:
            continue
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or (anchor and file.suffix == ".md" and anchor not in anchors(file)):
            dead.append(f"{path}#{anchor}")
    return dead


def commands(page: Path) -> Iterator[list[str]]:
    """Commands of asperity in blocks of shell, as words from `asperity` on."""
    text = page.read_text()
    blocks = re.findall(r"^ *```sh\n(.*?)^ *```", text, flags=re.DOTALL | re.MULTILINE)
    indented = re.findall(r"^    (?:\w+=\w+ )?asperity .*$", without_code(text), flags=re.MULTILINE)
    for line in [line for block in blocks for line in block.splitlines()] + indented:
        found = shlex.split(line, comments=True)
        if "asperity" in found:
            yield found[found.index("asperity") :]


def test_the_list_of_tests_is_current(tmp_path: Path) -> None:
    page = tmp_path / "tests.md"
    subprocess.run([sys.executable, str(REPOSITORY / "scripts/list_tests.py"), "--write", str(page)], check=True)
    assert page.read_text() == (REPOSITORY / "evidence/tests.md").read_text(), "scripts/list_tests.py --write evidence/tests.md"


def test_pages_are_short() -> None:
    count = {page: words(text_of(page)) for page in [*WRITTEN, *TUTORIALS]}
    total = sum(count.values())
    assert total <= ALL_WORDS, f"{total} words by hand in docs/: move measurements to evidence/"
    limits = {page: HOW_TO_WORDS if page.parent.name == "how-to" else PAGE_WORDS for page in count}
    limits |= {README: README_WORDS, DOCS / "trust.md": TRUST_WORDS}
    long = [f"{name(page)}: {words(text_of(page))} of {limit}" for page, limit in limits.items() if words(text_of(page)) > limit]
    assert not long


def test_paragraphs_and_lines_are_short() -> None:
    assert list(paragraphs("# A\n\none two\nthree\n- four\n\n```\nfive\n```\n| six |\n")) == ["one two three", "- four"]
    long = [f"{name(page)}: {p[:60]}…" for page in [*WRITTEN, README] for p in paragraphs(page.read_text()) if words(p) > PARAGRAPH_WORDS]
    assert not long
    lines = [(page, line) for page in [*WRITTEN, README] for line in without_code(by_hand(page.read_text())).splitlines()]
    text = [(page, line) for page, line in lines if not re.match(r"\s*\||    \S", line)]
    # Code and links are not broken.
    pieces = [(page, re.sub(r"`[^`]*`", "c", re.sub(r"\]\([^)]*\)", "]", line))) for page, line in text]
    assert not [f"{name(page)}: {piece[:60]}…" for page, piece in pieces if len(piece) > LINE_CHARACTERS]


@pytest.mark.parametrize("page", [*PAGES, *TUTORIALS, *EVIDENCE, *OTHERS], ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    assert not dead_links(page)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="scripts/gallery.py reads TOML")
def test_the_gallery_is_that_of_its_table() -> None:
    """Page and pictures; the pictures have at most 1.5 MB together."""
    done = subprocess.run([sys.executable, str(REPOSITORY / "scripts/gallery.py"), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert sum(picture.stat().st_size for picture in DOCS.glob("gallery/*.svg")) <= 1_500_000


def test_the_paper_is_short_and_cites_what_it_lists() -> None:
    head, text = (REPOSITORY / "paper/paper.md").read_text().split("---", 2)[1:]
    assert 750 <= words(re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)) <= 1_200
    listed = set(re.findall(r"@\w+\{(\w+),", (REPOSITORY / "paper/paper.bib").read_text()))
    # The file has the references of runs, too (`asperity cite`).
    assert set(re.findall(r"@(\w+)", text)) <= listed
    pictures = [REPOSITORY / "paper" / name for name in re.findall(r"!\[.*?\]\((.*?)\)", text)]
    assert pictures and all(picture.stat().st_size < 300_000 for picture in pictures)
    authors = re.findall(r"- name: (.*)", head)
    assert authors == re.findall(r'(?<=authors:\n  - name: ")[^"]*', (REPOSITORY / "CITATION.cff").read_text())


def test_every_page_is_in_the_index() -> None:
    index = (DOCS / "index.md").read_text()
    listed = {line for block in re.findall(r"```\{toctree\}\n(.*?)```", index, flags=re.DOTALL) for line in block.split()}
    pages = {str(page.relative_to(DOCS).with_suffix("")) for page in [*PAGES, *TUTORIALS]} - {"index"}
    evidence = {f"evidence/{page.stem}" for page in EVIDENCE if page.parent.name == "evidence"}
    assert pages | evidence <= listed


@pytest.mark.parametrize("page", [*PAGES, README], ids=name)
def test_commands_are_understood(page: Path) -> None:
    """With `--help` at its end the program reads a command and runs nothing."""
    for command in commands(page):
        done = subprocess.run([asperity.program(), *command[1:], "--help"], capture_output=True, text=True)
        assert done.returncode == 0, f"{shlex.join(command)}: {done.stderr}"


def test_there_are_commands_to_understand() -> None:
    assert sum(len(list(commands(page))) for page in [*PAGES, README]) > 50


def test_lines_of_python_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", (DOCS / "how-to" / "extend.md").read_text(), flags=re.DOTALL):
        exec(compile(block, "extend.md", "exec"), names)
    assert 0 < names["path"][1].observed["under tension"] < 1


def test_quotations_stand_in_the_documents() -> None:
    """The runs behind the numbers take minutes: `make claims`."""
    done = subprocess.run([sys.executable, str(REPOSITORY / "scripts/claims.py"), "--quotations"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def runs_of_pages() -> list[str]:
    """Those that take seconds: the others start LAMMPS."""
    claims = (REPOSITORY / "evidence/claims.toml").read_text()
    runs = set(re.findall(r'run = "([^"]+)"\ndocument = "docs/', claims))
    return sorted(runs & set(re.findall(r'\[run\.([^]]+)\]\n(?:(?!\[).*\n)*?cost = "seconds"', claims)))


@pytest.mark.skipif(sys.version_info < (3, 11), reason="scripts/claims.py reads TOML")
@pytest.mark.parametrize("run", runs_of_pages())
def test_pages_have_what_their_commands_print(run: str) -> None:
    words = [str(REPOSITORY / "scripts/claims.py"), "--asperity", str(asperity.program()), "--run", run]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
