#!/bin/sh
# Measures all methods on the shipped scenes, and puts what was found where the program reads it: data/measured.json. Folders of an
# earlier run are used again. $1: the program.
set -eu
program=$1
out=runs/measured
mkdir -p "$out"
tables=""
ladder() { # name, scene, flags
    folder="$out/$1"
    scene=$2
    shift 2
    "$program" tradeoff "$scene" --out "$folder" "$@" >/dev/null
    tables="$tables $folder/tradeoff.json"
}
# The first is what docs/trade-off-ladders.md tells of.
ladder fast configs/measured/waves-32.toml --methods fast --grids 1024,512,256,128,64,32 --reference 2048 --layer-thickness 0.05,0.1,0.143,0.2,0.5 --repeats 3
for seed in 1 2 3; do
    ladder "waves-32-$seed" configs/measured/waves-32.toml --seed $seed --grids 512,256,128,64,32 --reference 1024 --budget 6m
done
# With adhesion: two surfaces whose range a desk machine resolves, and the shipped scene, whose range none of its grids does.
for seed in 1 2; do
    ladder "adhesion-32-$seed" configs/measured/waves-32-adhesion.toml --seed $seed --methods fast --grids 512,256,128,64 --reference 1024
done
ladder adhesion configs/adhesion.toml --methods fast --grids 512,256,128 --reference 1024
# shellcheck disable=SC2086
"$program" merge-tables $tables --out data/measured.json --ladders docs/trade-off-ladders.md --provenance "make measured"
