#!/bin/sh
# Measures all methods on the shipped scenes and writes data/measured.json, which is compiled into the program. Folders of an
# earlier run are reused. $1: the program.
set -eu
program=$1
out=runs/measured
mkdir -p "$out"
tables=""
series() { # name, scene, flags
    folder="$out/$1"
    scene=$2
    shift 2
    "$program" tradeoff "$scene" --out "$folder" "$@" >/dev/null
    tables="$tables $folder/tradeoff.json"
}
# The first is the source of docs/trade-off-series.md.
series fast configs/measured/waves-32.toml --methods fast --grids 1024,512,256,128,64,32 --reference 2048 --layer-thickness 0.05,0.1,0.143,0.2,0.5 --repeats 3
for seed in 1 2 3; do
    series "waves-32-$seed" configs/measured/waves-32.toml --seed $seed --grids 512,256,128,64,32 --reference 1024 --budget 6min
done
# With adhesion: two surfaces whose range a workstation resolves, and the shipped scene, whose range none of its grids resolves.
for seed in 1 2; do
    series "adhesion-32-$seed" configs/measured/waves-32-adhesion.toml --seed $seed --methods fast --grids 512,256,128,64 --reference 1024
done
series adhesion configs/adhesion.toml --methods fast --grids 512,256,128 --reference 1024
# All waves of the challenge: without adhesion four points per shortest wave, with adhesion what its grid has.
series waves-1000 configs/measured/waves-1000.toml --methods fast,persson --grids 4096,2048,1024,512,256,128,64 --reference 4096
series challenge configs/challenge.toml --methods fast --grids 1024,512,256,128 --reference 2048
# shellcheck disable=SC2086
cargo bench --locked --bench measure -- merge-tables $tables --out data/measured.json --series docs/trade-off-series.md --provenance "make measured"
