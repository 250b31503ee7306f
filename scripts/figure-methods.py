#!/usr/bin/env python3
"""Writes docs/methods.svg: a profile in contact as docs/methods.md describes it, and the stiffness of the elastic bodies. Needs numpy.

Usage: scripts/figure-methods.py [FILE]
"""

import sys
from pathlib import Path

import numpy as np

N = 256
PRESSURE, POISSON = 0.02, 0.3
#: Pixels of a panel, its corner, and pixels per unit of length.
WIDTH, HEIGHT, TOP = 320, 170, 40
SCALE = WIDTH


def profile() -> np.ndarray:
    """Heights of a rigid line; low points touch first."""
    x = np.arange(N) / N
    waves = [(1, 0.05, 0.3), (2, 0.03, 1.1), (3, 0.022, 4.0), (5, 0.012, 2.2), (9, 0.006, 0.4)]
    h = sum(a * np.cos(2 * np.pi * k * x + phase) for k, a, phase in waves)
    return h - h.min()


def solve(h: np.ndarray) -> np.ndarray:
    """Gap of a half-space under the mean pressure, in line contact: projected gradient steps on the energy of docs/methods.md."""
    k = np.pi * np.arange(N // 2 + 1)  # q/2, E* = L = 1
    gap = np.full(N, h.mean())
    precondition = 1 / np.maximum(k, k[1])
    for _ in range(20000):
        slope = np.fft.irfft(k * np.fft.rfft(gap - h), N) + PRESSURE
        active = (gap > 0) | (slope < 0)
        step = np.fft.irfft(precondition * np.fft.rfft(np.where(active, slope, 0)), N)
        gap = np.maximum(gap - 0.1 * np.where(active, step, 0), 0)
    return gap


def bonded(w: np.ndarray) -> np.ndarray:
    nu = POISSON
    above = (3 - 4 * nu) * np.cosh(2 * w) + 2 * w**2 - 4 * nu * (3 - 2 * nu) + 5
    return above / ((3 - 4 * nu) * np.sinh(2 * w) - 2 * w)


def loaded(w: np.ndarray) -> np.ndarray:
    return (np.cosh(2 * w) - 2 * w**2 - 1) / (np.sinh(2 * w) + 2 * w)


def path(x: np.ndarray, y: np.ndarray) -> str:
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y))


def text(x: float, y: float, words: str, anchor: str = "start", colour: str = "#222") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def contact() -> list[str]:
    """The left panel. The body is drawn below, so that low points of the heights are its neighbours."""
    h = profile()
    gap = solve(h)
    x = 20 + WIDTH * np.arange(N + 1) / N
    rigid, body = (TOP + 100 - SCALE * np.append(v, v[0]) for v in (h, h - gap))
    top, bottom = TOP - 20, TOP + HEIGHT
    parts = [
        f'<path d="{path(x, rigid)}L{x[-1]:.1f} {top}L{x[0]:.1f} {top}Z" fill="#9bb5d6"/>',
        f'<path d="{path(x, body)}L{x[-1]:.1f} {bottom}L{x[0]:.1f} {bottom}Z" fill="#f1d9b5"/>',
    ]
    touching = np.append(gap, gap[0]) <= 0
    for i in np.flatnonzero(touching[:-1] & touching[1:]):
        parts.append(f'<path d="{path(x[i : i + 2], body[i : i + 2])}" stroke="#000" stroke-width="3"/>')
    widest = int(np.argmax(gap))
    parts.append(f'<path d="M{x[widest]:.1f} {rigid[widest]:.1f}V{body[widest]:.1f}" stroke="#c4420f" stroke-width="1.5"/>')
    parts.append(text(x[widest] - 6, (rigid[widest] + body[widest]) / 2 + 4, "gap g", "end", "#c4420f"))
    parts.append(text(180, top + 16, "rigid, heights h", "middle"))
    parts.append(text(180, bottom - 12, "elastic, E*", "middle"))
    parts.append(text(180, top - 6, "mean pressure p; contact is black", "middle"))
    return parts


def stiffness() -> list[str]:
    """The right panel: k(q) of a layer over that of the half-space."""
    left, width, low, high, most = 420, 270, -1.0, 1.0, 4.0
    w = np.logspace(low, high, 121)
    right, bottom = left + width, TOP + HEIGHT - 20

    def at(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return left + width * (np.log10(x) - low) / (high - low), bottom - (bottom - TOP) * y / most

    parts = [f'<path d="M{left} {TOP}V{bottom}H{right}" fill="none" stroke="#222"/>']
    for name, of, colour, dash, (tx, ty) in [
        ("layer, bonded", bonded, "#0072b2", "", (0.95, 3.1)),
        ("half-space", lambda w: np.ones_like(w), "#222", "6 3", (3.2, 1.22)),
        ("layer, constant stress", loaded, "#c4420f", "2 3", (0.13, 0.25)),
    ]:
        values = of(w)
        shown = values <= most
        parts.append(f'<path d="{path(*at(w[shown], values[shown]))}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}"/>')
        parts.append(text(*(float(v) for v in at(np.array(tx), np.array(ty))), name, colour=colour))
    for value in (0.1, 1, 10):
        parts.append(text(float(at(np.array(value), np.array(0))[0]), bottom + 16, f"{value:g}", "middle"))
    for value in range(5):
        parts.append(text(left - 6, float(at(np.array(1.0), np.array(value))[1]) + 4, str(value), "end"))
    parts.append(text(left + width / 2, bottom + 34, "wave number times thickness, qd", "middle"))
    parts.append(text(left + width / 2, TOP - 26, f"stiffness k(q) over q/2, ν = {POISSON}", "middle"))
    return parts


def main() -> None:
    root = Path(__file__).resolve().parent.parent
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else root / "docs/methods.svg"
    drawn = "\n".join([*contact(), *stiffness()])
    head = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 250" font-family="sans-serif" font-size="13">\n<rect width="720" height="250" fill="#fff"/>\n'
    out.write_text(f"{head}{drawn}\n</svg>\n", encoding="utf-8")


if __name__ == "__main__":
    main()
