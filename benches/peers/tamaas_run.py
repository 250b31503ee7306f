"""Tamaas' solver of Polonsky, Keer and Rey on a height map.

usage: tamaas_run.py HEIGHTS.npy PRESSURE TOLERANCE OUT.npy [non-periodic | HARDNESS]

With a hardness, its solver of Kato with saturated pressure.

TOLERANCE as Tamaas defines it: sum of pressure times gap over sum of pressure times rms height, the lowest gap being zero.
"""

import json
import sys
import time

import numpy as np
import tamaas


def main():
    heights, load, tolerance, out = np.load(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), sys.argv[4]
    law = sys.argv[5] if len(sys.argv) > 5 else "periodic"
    tamaas.set_log_level(tamaas.LogLevel.warning)
    # In Tamaas, high points touch first.
    surface = np.ascontiguousarray(heights.max() - heights)
    del heights
    clock, cpu = time.perf_counter(), time.process_time()
    model = tamaas.Model(tamaas.model_type.basic_2d, [1.0, 1.0], list(surface.shape))
    # E* = E / (1 - nu^2) = 1.
    model.E, model.nu = 1.0, 0.0
    if law in ("periodic", "non-periodic"):
        solver = tamaas.PolonskyKeerRey(model, surface, tolerance)
    else:
        solver = tamaas.KatoSaturated(model, surface, tolerance, float(law))
    if law == "non-periodic":
        tamaas.ModelFactory.registerNonPeriodic(model, "non-periodic")
        solver.setIntegralOperator("non-periodic")
    solver.max_iter = 5_000
    error = solver.solve(load)
    seconds, cpu = time.perf_counter() - clock, time.process_time() - cpu
    np.save(out, model.traction)
    print(json.dumps(dict(converged=bool(error <= tolerance), seconds=seconds, cpu_seconds=cpu)))


if __name__ == "__main__":
    main()
