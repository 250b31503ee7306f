#!/usr/bin/env python3
"""Makes the pictures of docs/gallery.md anew, and writes the page.

    scripts/gallery.py --asperity target/release/asperity            # as `make gallery` does
    scripts/gallery.py --asperity target/release/asperity --only seal
    scripts/gallery.py --page                                        # the page alone

docs/gallery/gallery.toml lists commands, pictures and captions. Commands run in the repository and resume what they find in runs/. A picture is
a figure of the run folder, on white and at WIDTH; the two quantities that asperity draws no figure of are drawn here, in the style of its figures
(needs numpy and matplotlib). Python 3.11 or newer.
"""

import argparse
import csv
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "docs/gallery/gallery.toml"
PICTURES = ROOT / "docs/gallery"
PAGE = ROOT / "docs/gallery.md"

#: Width of a picture, pixels; where figures have this width in a run folder, text has 8 pt.
WIDTH, FIGURES = 480, "84mm"

HEAD = """# Gallery

<!-- generated: make gallery -->

Each picture is a figure that asperity writes, or a map or table of its folder. The commands make them anew, in the repository, after `make demo`;
`make gallery` runs all of them.
"""


def runs():
    return tomllib.loads(TABLE.read_text())["run"]


def execute(run, program):
    """Runs the commands of a run, then writes its figures for papers. The challenge ends with 1 where a statement of the paper fails."""
    for command in [*run["commands"], f"asperity report {run['folder']} --figures svg --width {FIGURES}"]:
        print(f"$ {command}", flush=True)
        code = subprocess.run([str(program), *shlex.split(command)[1:]], cwd=ROOT, stdout=subprocess.DEVNULL).returncode
        if code not in (0, 1):
            sys.exit(f"gallery: {command} ended with {code}")


def on_white(figure):
    """A figure at the width of the page, on white: a page may be dark."""
    head = re.search(r"<svg\b[^>]*>", figure)
    width, height = (float(v) for v in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', head[0]).groups())
    sized = re.sub(r' (width|height)="[^"]*"', "", head[0])
    sized = sized.replace("<svg", f'<svg width="{WIDTH}" height="{round(WIDTH * height / width)}"', 1)
    return figure[: head.start()] + sized + '<rect width="100%" height="100%" fill="#fff"/>' + figure[head.end() :]


def figure_and_axes(folder, height):
    """Axes as wide as the figures of a run folder, in their style."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.style.use(folder / "figures" / FIGURES / "asperity.mplstyle")
    plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "asperity", "font.sans-serif": ["Arial", "Liberation Sans", "DejaVu Sans"]})
    return plt.subplots(figsize=(84 / 25.4, height / 25.4), layout="constrained")


def leakage(folder):
    """Hydraulic gaps over the pressure; a sealed direction has none on a logarithmic axis."""
    rows = list(csv.DictReader((folder / "curve.csv").open()))
    figure, axes = figure_and_axes(folder, 62)
    for axis, colour, line in (("x", "#0072b2", "o-"), ("y", "#e69f00", "s--")):
        name = f"hydraulic_gap_{axis}"
        unsealed = [r for r in rows if float(r[f"{name}_um"]) > 0]
        pressure, gap, error = ([float(r[n]) for r in unsealed] for n in ("pressure_MPa", f"{name}_um", f"{name}_error_um"))
        axes.errorbar(pressure, gap, error, fmt=line, color=colour, label=f"along {axis}", capsize=2)
    effective = [(float(r["pressure_MPa"]), float(r["hydraulic_gap_effective_medium_um"])) for r in rows]
    axes.plot(*zip(*[e for e in effective if e[1] > 0]), "k:", label="effective medium")
    axes.set(xscale="log", yscale="log", xlabel="mean pressure (MPa)", ylabel="hydraulic gap (µm)")
    axes.set_xticks([0.05, 0.1, 0.2, 0.5], ["0.05", "0.1", "0.2", "0.5"])
    axes.set_yticks([0.01, 0.1, 1], ["0.01", "0.1", "1"])
    axes.minorticks_off()
    figure.legend(loc="outside upper left", ncols=3)
    return figure


def dents(folder):
    """The plastic displacement of the last load."""
    import numpy as np

    loads = len(list(csv.DictReader((folder / "curve.csv").open())))
    length = float(re.search(r'length = "([\d.]+) um"', (folder / "scene.toml").read_text())[1])
    # Fields of a run folder are in units of the length of the cell.
    depth = 1000 * length * np.load(folder / f"continuum/load-{loads}-plastic.npy")
    figure, axes = figure_and_axes(folder, 96)
    axes.grid(False)
    axes.spines[:].set_visible(True)
    image = axes.imshow(depth, extent=(0, length, 0, length), cmap="cividis", vmin=0)
    axes.set(xlabel="x (µm)", ylabel="y (µm)")
    figure.colorbar(image, label="plastic displacement (nm)", location="bottom", aspect=40, pad=0.02)
    return figure


def make(run):
    folder = ROOT / run["folder"]
    for picture in run["picture"]:
        target = PICTURES / f"{picture['file']}.svg"
        if "draw" in picture:
            {"leakage": leakage, "dents": dents}[picture["draw"]](folder).savefig(target, metadata={"Date": None, "Creator": None})
            text = target.read_text()
        else:
            text = (folder / "figures" / FIGURES / f"{picture['figure']}.svg").read_text()
        target.write_text(on_white(text))
        print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1000:.0f} kB", flush=True)


def page():
    parts = [HEAD]
    for run in runs():
        needs = f" (needs {run['needs']})" if "needs" in run else ""
        figures = [f"asperity report {run['folder']} --figures svg"]
        parts.append(f"## {run['title']}{needs}\n\n```sh\n" + "\n".join([*run["commands"], *figures]) + "\n```\n")
        for picture in run["picture"]:
            origin = f"`{picture['figure']}.svg`" if "figure" in picture else "drawn by `scripts/gallery.py`"
            alt = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", picture["caption"]).replace("\\*", "°").replace("*", "").replace("°", "*")
            parts.append(f"![{alt}](gallery/{picture['file']}.svg)\n\n{picture['caption']} ({origin})\n")
    return "\n".join(parts) + "\n<!-- end of generated -->\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", type=Path, default=ROOT / "target/release/asperity")
    parser.add_argument("--only", help="the run with this folder's name alone")
    parser.add_argument("--page", action="store_true", help="write the page alone")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if the page is not that of the table or a picture is missing")
    arguments = parser.parse_args()
    files = {picture["file"] for run in runs() for picture in run["picture"]}
    if arguments.check:
        pictures = {file.stem for file in PICTURES.glob("*.svg")}
        if PAGE.read_text() != page() or files != pictures:
            sys.exit(f"gallery: scripts/gallery.py --page; pictures that differ from the table: {sorted(files ^ pictures)}")
        return
    for run in [] if arguments.page else runs():
        if arguments.only in (None, Path(run["folder"]).name):
            execute(run, arguments.asperity.absolute())
            make(run)
    PAGE.write_text(page())


if __name__ == "__main__":
    main()
