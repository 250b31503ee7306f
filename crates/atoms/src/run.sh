#!/bin/sh
# Runs this job from its first step, with the command line of `asperity atoms run`: bash run.sh
# Another program: LMP="mpirun -np 4 lmp" bash run.sh
set -eu
cd "$(dirname "$0")"
if [ -e load_steps.csv ]; then
    echo "run.sh: load_steps.csv has finished steps: asperity atoms run . continues after them; without this file the job begins anew" >&2
    exit 2
fi
LMP=${LMP:-$(command -v lmp || command -v lammps || echo lmp)}
# One thread per process, and what this LAMMPS was built with.
export OMP_NUM_THREADS=1
styles=$(PAGER=cat $LMP -h </dev/null)
options=""
case $styles in *eam/alloy/opt*) options="-sf opt" ;; esac
case $styles in *custom/zstd*) options="$options -var dump_style custom/zstd -var dump_end dump.zst" ;; esac
exec $LMP -in @SCRIPT@ -nocite -log log.0 $options $(cat in.vars)
