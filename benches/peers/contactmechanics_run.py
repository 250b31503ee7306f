"""ContactMechanics' half-space with NuMPI's constrained conjugate gradients with restart, on a height map.

usage: contactmechanics_run.py HEIGHTS.npy PRESSURE TOLERANCE OUT.npy [non-periodic]

TOLERANCE is the largest remaining gap in the contact over the rms height. Of the package's solvers this is the fastest
that converged in all tests.
"""

import json
import sys
import time

import numpy as np
from ContactMechanics import FreeFFTElasticHalfSpace, PeriodicFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from NuMPI.Optimization import CCGWithRestart
from SurfaceTopography import Topography


def main():
    heights, load, tolerance, out = np.load(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    periodic = len(sys.argv) <= 5
    area, rms = 1.0 / heights.size, heights.std()
    clock, cpu = time.perf_counter(), time.process_time()
    # In SurfaceTopography, high points touch first.
    surface = Topography(-heights, physical_sizes=(1.0, 1.0), periodic=periodic)
    half_space = (PeriodicFFTElasticHalfSpace if periodic else FreeFFTElasticHalfSpace)(heights.shape, 1.0, (1.0, 1.0))
    system = NonSmoothContactSystem(substrate=half_space, surface=surface)
    shape = heights.shape
    del heights
    # Unknowns are forces on nodes.
    found = CCGWithRestart.constrained_conjugate_gradients_with_restart(
        system.dual_objective(0.0, gradient=True),
        system.dual_hessian_product,
        x0=np.full(shape, load * area),
        mean_val=load * area,
        gtol=tolerance * rms,
        maxiter=20_000,
    )
    seconds, cpu = time.perf_counter() - clock, time.process_time() - cpu
    np.save(out, found.x.reshape(shape) / area)
    print(json.dumps(dict(converged=bool(found.success), iterations=found.nit, seconds=seconds, cpu_seconds=cpu)))


if __name__ == "__main__":
    main()
