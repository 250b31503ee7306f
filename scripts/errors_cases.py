"""Random cases of scripts/errors.py: a surface, flags of `solve`, and a load, from a seed."""

import math

import numpy as np

from errors_surfaces import Profile, Surface, band_limited, bump, grooves, interpolated, plateau_honed, self_affine, stepped

KINDS = ["hard wall", "adhesion", "hardness", "layer", "penalty", "non-periodic", "stepped", "grooves", "profile"]
FINER = 8  # the grid of the truth, over that of the case; the residual error of the truth is from half of it


def log_uniform(rng, low, high):
    return math.exp(rng.uniform(math.log(low), math.log(high)))


class Case:
    def __init__(self, name, kind, surface, gradient, flags, load, sizes):
        self.name, self.kind, self.surface, self.gradient = name, kind, surface, gradient
        self.flags, self.load, self.sizes = flags, load, sizes

    def heights(self, n):
        s = self.surface
        if n >= s.points:
            return s.heights(n)
        if s.function is not None or isinstance(s, Profile):
            return s.heights(n)
        modes = band_limited(s.heights(s.points), n, 0.0)
        return interpolated(modes, n)

    def describe(self):
        flags = " ".join(f"{f:.4g}" if isinstance(f, float) else str(f) for f in self.flags)
        return f"{self.name}: {self.surface.kind} {self.surface.points}², {flags} p={self.load:.4g}"


def patch(rng, points, gradient, cut):
    """A rough map that is not periodic, its nodes at the centres of cells."""
    count = 80
    q = np.exp(rng.uniform(0.0, np.log(max(1.5, 1 / cut)), count))
    angle, phase = rng.uniform(0, 2 * np.pi, (2, count))
    amplitude = q**-1.5
    amplitude *= gradient / math.sqrt(np.sum((2 * np.pi * q * amplitude) ** 2) / 2)

    def height(x, y):
        x, y = x[0], y[:, 0]
        x, y = x + 0.5 / len(x), y + 0.5 / len(y)
        a = 2 * np.pi * q * np.cos(angle)
        b = 2 * np.pi * q * np.sin(angle)
        along = np.exp(1j * np.outer(a, x))
        across = np.exp(1j * (np.outer(y, b) + phase)) * amplitude
        return (across @ along).real

    return Surface("patch", points, function=height)


def centred(surface):
    """The same function with its nodes at the centres of cells, as maps that are not periodic have them."""
    inner = surface.function

    def height(x, y):
        return inner(x + 0.5 / x.shape[1], y + 0.5 / x.shape[0])

    return Surface(surface.kind, surface.points, function=height)


def surface(rng, points, gradient, kind):
    shortest = float(rng.choice([2, 3, 4, 6, 8, 12])) / points
    if kind == "stepped":
        return stepped(rng, points, gradient)
    if kind == "non-periodic":
        return centred(bump(rng, points, gradient)) if rng.uniform() < 0.4 else patch(rng, points, gradient, max(shortest, 4 / points))
    if kind == "profile":
        return Profile(rng, points, rng.uniform(0.2, 1.0), max(shortest, 4 / points), gradient)
    if kind == "grooves":
        return grooves(rng, points, rng.uniform(0.2, 1.0), shortest, gradient, float(rng.choice([0.0, 0.01, 0.1, 0.3])))
    draw = rng.uniform()
    hurst, roll_off = rng.uniform(0.3, 1.0), float(rng.choice([0.0, 0.25, 0.5]))
    if draw < 0.55:
        return self_affine(rng, points, hurst, roll_off, shortest, gradient)
    if draw < 0.70:
        return self_affine(rng, points, hurst, roll_off, shortest, gradient, stretch=log_uniform(rng, 1.5, 4.0))
    if draw < 0.88:
        return plateau_honed(rng, points, max(shortest, 3 / points), gradient)
    # The map is all that the program has: its series is the surface.
    smooth = bump(rng, points, gradient)
    return Surface(smooth.kind, points, modes=band_limited(smooth.heights(8 * points), points, 0.0))


def energy_of_full_contact(heights):
    n = heights.shape[0]
    modes = np.fft.fft2(heights) / n**2
    k = np.fft.fftfreq(n, 1.0 / n)
    q = 2 * np.pi * np.hypot(k[:, None], k[None, :])
    return float(np.sum(q * np.abs(modes) ** 2) / 4)


def adhesive(rng, heights, resolution):
    """Work of adhesion and range of a cohesive resolution on the grid of these heights."""
    gamma = energy_of_full_contact(heights) * log_uniform(rng, 0.003, 0.4)
    return ["--work-of-adhesion", gamma, "--range", resolution * math.sqrt(gamma / heights.shape[0])]


def points_of(rng, kind):
    if kind == "profile":
        return int(rng.choice([128, 256, 512]))
    return int(rng.choice([32, 64, 128], p=[0.45, 0.35, 0.2]) if kind != "non-periodic" else rng.choice([24, 32, 48], p=[0.3, 0.4, 0.3]))


def field_case(kind, seed, index):
    """For all quantities that follow from the fields of one load."""
    rng = np.random.default_rng([seed, KINDS.index(kind), index])
    n = points_of(rng, kind)
    gradient = log_uniform(rng, 0.01, 1.0)
    s = surface(rng, n, gradient, kind)
    # The series of a map that is not periodic has the steps at its seam.
    measured = gradient if kind == "non-periodic" else s.rms_gradient()
    flags, p_star = [], log_uniform(rng, 1e-4, 1.0)
    if kind == "adhesion":
        flags = [*adhesive(rng, s.heights(n), log_uniform(rng, 1.4, 4.0)), "--resolution", "true"]
    elif kind == "hardness":
        hardness = measured * log_uniform(rng, 0.03, 1.0)
        flags = ["--hardness", hardness]
        p_star = min(p_star, 0.7 * hardness / measured)
    elif kind == "layer":
        flags = ["--thickness", log_uniform(rng, 0.1 / n, 0.5), "--poisson", float(rng.choice([0.0, 0.3, 0.45, 0.49, 0.5]))]
        if rng.uniform() < 0.2:
            flags += ["--base", "constant-stress"]
    elif kind == "penalty":
        flags = ["--wall", "penalty", "--penalty-length", log_uniform(rng, 0.1, 30.0) / n]
    elif kind == "non-periodic":
        flags = ["--non-periodic"]
    if kind == "non-periodic" and s.kind != "patch":
        p_star = log_uniform(rng, 1e-3, 0.3)
    flags += ["--profile"] if kind == "profile" else ["--leakage"]
    # Thin layers need other pressures than p* for the same contact; these cases are found by their contact.
    by_contact = kind in ("layer", "penalty")
    case = Case(f"{kind} {seed}.{index}", kind, s, measured, flags, p_star * measured, (n, FINER // 2 * n, FINER * n))
    case.contact = log_uniform(rng, 0.003, 0.7) if by_contact else None
    return case


def extrapolation_case(seed, index):
    rng = np.random.default_rng([seed, 100, index])
    n = int(rng.choice([32, 64, 128], p=[0.3, 0.5, 0.2]))
    s = surface(rng, n, log_uniform(rng, 0.03, 1.0), "adhesion")
    flags = [*adhesive(rng, s.heights(n), log_uniform(rng, 0.55, 1.3))]
    gradient = s.rms_gradient()
    # On all finer grids the true range is resolved: 1.4 / sqrt(8) = 0.5.
    sizes = (n, 8 * n, 16 * n) if n < 128 else (n, 4 * n, 8 * n)
    return Case(f"extrapolation {seed}.{index}", "adhesion", s, gradient, flags, log_uniform(rng, 1e-3, 0.5) * gradient, sizes)


def pull_off_case(seed, index):
    rng = np.random.default_rng([seed, 101, index])
    n = int(rng.choice([24, 32], p=[0.4, 0.6]))
    s = surface(rng, n, log_uniform(rng, 0.03, 1.0), "adhesion")
    flags = [*adhesive(rng, s.heights(n), log_uniform(rng, 1.4, 4.0)), "--resolution", "true", "--pull-off"]
    gradient = s.rms_gradient()
    return Case(f"pull-off {seed}.{index}", "adhesion", s, gradient, flags, log_uniform(rng, 1e-2, 0.3) * gradient, (n, 2 * n, 4 * n))


def stiffness_case(seed, index):
    kinds = ["hard wall", "layer", "penalty", "non-periodic", "stepped", "adhesion", "grooves", "profile"]
    kind = kinds[index % len(kinds)]
    rng = np.random.default_rng([seed, 102, index])
    n = points_of(rng, kind) if kind == "profile" else int(rng.choice([32, 64] if kind != "non-periodic" else [16, 24, 32]))
    gradient = log_uniform(rng, 0.03, 1.0)
    s = surface(rng, n, gradient, kind)
    gradient = gradient if kind == "non-periodic" else s.rms_gradient()
    flags = []
    if kind == "layer":
        flags = ["--thickness", log_uniform(rng, 0.5 / n, 0.5), "--poisson", float(rng.choice([0.0, 0.3, 0.45, 0.49, 0.5]))]
    elif kind == "penalty":
        flags = ["--wall", "penalty", "--penalty-length", log_uniform(rng, 0.3, 30.0) / n]
    elif kind == "non-periodic":
        flags = ["--non-periodic"]
    elif kind == "adhesion":
        flags = [*adhesive(rng, s.heights(n), log_uniform(rng, 1.4, 4.0)), "--resolution", "true"]
    elif kind == "profile":
        flags = ["--profile"]
    case = Case(f"stiffness {seed}.{index}", kind, s, gradient, flags, log_uniform(rng, 1e-3, 0.3) * gradient, (n, 4 * n, 8 * n))
    case.contact = log_uniform(rng, 0.005, 0.6) if kind in ("layer", "penalty") else None
    # Alone, or the middle of a path whose loads are a factor apart.
    case.factor = None if rng.uniform() < 0.5 else log_uniform(rng, 1.2, 4.0)
    return case
