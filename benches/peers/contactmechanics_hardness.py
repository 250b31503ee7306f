"""ContactMechanics' constrained conjugate gradients with a penetration hardness, on a periodic height map.

usage: contactmechanics_hardness.py HEIGHTS.npy PRESSURE HARDNESS TOLERANCE OUT.npy [FORCE]

TOLERANCE is the largest remaining penetration over the rms height, FORCE the relative error of the force.
"""

import json
import sys
import time

import numpy as np
from ContactMechanics import PeriodicFFTElasticHalfSpace
from ContactMechanics.Optimization import constrained_conjugate_gradients
from SurfaceTopography import Topography

# Relative error of the force, by default.
FORCE = 1e-9
ITERATIONS = 20_000


def main():
    heights = np.load(sys.argv[1])
    load, hardness, tolerance = map(float, sys.argv[2:5])
    force = float(sys.argv[6]) if len(sys.argv) > 6 else FORCE
    area = 1.0 / heights.size
    cpu = time.process_time()
    # In SurfaceTopography, high points touch first.
    surface = Topography(-heights, physical_sizes=(1.0, 1.0), periodic=True)
    half_space = PeriodicFFTElasticHalfSpace(heights.shape, 1.0, (1.0, 1.0))
    # The solver's unknowns and its hardness are forces on nodes.
    found = constrained_conjugate_gradients(
        half_space,
        surface,
        hardness=hardness * area,
        external_force=load,
        pentol=tolerance * heights.std(),
        forcetol=force * load,
        thermotol=force,
        maxiter=ITERATIONS,
    )
    cpu = time.process_time() - cpu
    np.save(sys.argv[5], np.asarray(found.jac) / area)
    print(json.dumps(dict(converged=bool(found.success), iterations=int(found.nit), cpu_seconds=cpu)))


if __name__ == "__main__":
    main()
