#!/bin/sh
# Onset of plasticity by block size and by resolved rms gradient: the literal profile, and profiles scaled to a gradient. Each load
# starts from the continuum solution. $1: the program; $2: sizes as CELLSxDEPTH (default 15x6 45x12); $3: MPI ranks.
# Folders of an earlier run are reused.
set -eu
program=$1
sizes=${2:-15x6 45x12}
ranks=${3:-1}
out=runs/first-yield
mkdir -p "$out"
press() { # name, cells, depth, rms gradient, slope, loads
    cat >"$out/$1.toml" <<SCENE
name = "$1"

[surface]
grid = 512
seed = 18
rms_gradient = $4

[load]
p_star = [$6]

[atoms]
cells = $2
depth_cells = $3
slope = "$5"
plasticity = true
# Load and base decide when a load ends: in a flowing crystal some atoms always have a force.
force_tolerance = "0.4 eV/Å"
ranks = $ranks
SCENE
    printf '%s: ' "$1"
    # Warnings (loads that were not reached) are in the log.
    if "$program" run "$out/$1.toml" --out "$out/$1" >"$out/$1.out" 2>"$out/$1.log"; then
        grep 'out of the crystal' "$out/$1.out"
    else
        tail -n 1 "$out/$1.log"
        exit 1
    fi
}
for size in $sizes; do
    cells=${size%x*}
    depth=${size#*x}
    press "$size-slope-0.2" "$cells" "$depth" 0.2 renormalised "0.01, 0.02, 0.03, 0.04, 0.05, 0.07"
    press "$size-literal" "$cells" "$depth" 1.0 literal "0.001, 0.002, 0.003, 0.004, 0.005, 0.007, 0.01, 0.02, 0.03"
    press "$size-slope-1" "$cells" "$depth" 1.0 renormalised "0.0002, 0.0005, 0.001, 0.0015, 0.002, 0.003, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05"
done
