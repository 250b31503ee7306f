#!/usr/bin/env python3
"""Makes the figures of paper.md anew, from runs of docs/gallery/gallery.toml.

    paper/figures.py --asperity target/release/asperity      # as `make paper` does

Runs resume what they find in runs/. Needs LAMMPS, numpy and matplotlib; Python 3.11 or newer.
"""

import argparse
import csv
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "scripts"))
import gallery  # noqa: E402

#: Width of the text, inches.
WIDTH = 6.3


def folder_of(name):
    return ROOT / "runs" / name / "figures" / gallery.FIGURES


def cells(file):
    with file.open(newline="") as text:
        return [[float(v) for v in row] for row in csv.reader(text)]


def curves(file):
    """The curves of a figure by their names, as lists of x and y."""
    found = {}
    with file.open(newline="", encoding="utf-8") as text:
        for label, x, y, _ in list(csv.reader(text))[1:]:
            found.setdefault(label, ([], []))
            found[label][0].append(float(x))
            found[label][1].append(float(y))
    return found


def maps(plt, colours):
    """Contact of continuum and atoms, and both superposed, at the second load of the quickstart."""
    folder = folder_of("quickstart")
    figure, panels = plt.subplots(1, 3, figsize=(WIDTH, 2.45), sharey=True, layout="constrained")
    for axes, name, title in zip(panels, ["contact-matched-2", "contact-atoms-2", "superposed-2"], ["continuum", "atoms", "superposed"]):
        # The map of the atoms alone has 1 for contact; superposed they are 2.
        values = [[2 * v if name.startswith("contact-atoms") else v for v in row] for row in cells(folder / f"{name}.csv")]
        extent = [float(v) for v in re.search(r'extent\\":\[([^]]*)\]', (folder / f"{name}.py").read_text())[1].split(",")]
        axes.imshow(values, extent=extent, cmap=colours, vmin=-0.5, vmax=3.5)
        axes.set(xlabel="x (nm)", title=title)
        axes.grid(False)
        axes.spines[:].set_visible(True)
    panels[0].set_ylabel("y (nm)")
    figure.savefig(HERE / "maps.png")


def challenge(plt):
    """Contact area and mean gap over the load, for the problem of the challenge."""
    folder = folder_of("challenge-1024")
    figure, panels = plt.subplots(1, 2, figsize=(WIDTH, 2.5), layout="constrained")
    looks = {"with adhesion, loading": ("#0072b2", "o-"), "without": ("#e69f00", "s--")}
    for axes, name in zip(panels, ["figure-10", "figure-12"]):
        found = curves(folder / f"{name}.csv")
        for label, (colour, line) in looks.items():
            axes.plot(*found[label], line, color=colour, label="without adhesion" if label == "without" else "with adhesion")
        theory = next(label for label in found if label.startswith(("erf", "0.3")))
        axes.plot(*found[theory], "k:", label=theory)
        axes.set(xlabel="load p*", yscale="log")
        axes.legend()
    panels[0].set(ylabel="contact area over that of the cell", xscale="log")
    panels[1].set(ylabel="mean gap (µm)")
    figure.savefig(HERE / "challenge.png")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--asperity", type=Path, default=ROOT / "target/release/asperity")
    arguments = parser.parse_args()
    for run in gallery.runs():
        if Path(run["folder"]).name in ("quickstart", "challenge-1024"):
            gallery.execute(run, arguments.asperity.absolute())

    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.style.use(folder_of("quickstart") / "asperity.mplstyle")
    # White: open; orange: continuum only; blue: atoms only; black: both.
    maps(plt, matplotlib.colors.ListedColormap(["#ffffff", "#e69f00", "#0072b2", "#000000"]))
    challenge(plt)
    for file in sorted(HERE.glob("*.png")):
        print(f"{file.relative_to(ROOT)}: {file.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
