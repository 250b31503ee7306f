#!/bin/sh
# Runs this job from its first step with LAMMPS alone: bash run.sh
# It relaxes by FIRE, in ramps by conjugate gradients. `asperity atoms run` relaxes in fewer force evaluations where it finds the library of
# LAMMPS; the states agree within the tolerance unless the crystal slips.
# Another program: LMP="mpirun -np 4 lmp" bash run.sh
set -eu
cd "$(dirname "$0")"
if [ -e load_steps.csv ]; then
    echo "run.sh: load_steps.csv has finished steps: asperity atoms run . continues after them; without this file the job begins anew" >&2
    exit 2
fi
# LAMMPS keeps the lock to its end.
if command -v flock >/dev/null; then
    exec 9>>job.lock
    flock -n -E 75 9 || [ $? -ne 75 ] || {
        echo "run.sh: another program is writing or running this job: wait for its end, or end it" >&2
        exit 2
    }
fi
LMP=${LMP:-$(command -v lmp || command -v lammps || echo lmp)}
# One thread per process, and what this LAMMPS was built with.
export OMP_NUM_THREADS=1
styles=$(PAGER=cat $LMP -h </dev/null)
options=""
case $styles in *eam/alloy/opt*) options="-sf opt" ;; esac
case $styles in *custom/zstd*) options="$options -var dump_style custom/zstd -var dump_end dump.zst" ;; esac
exec $LMP -in @SCRIPT@ -nocite -log log.0 $options $(cat in.vars)
