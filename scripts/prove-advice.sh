#!/bin/sh
# Holds what `asperity advise` says against what is found, on surfaces that no table has seen: five other seeds, two other
# spectra, and a seed with adhesion. $1: the program.
set -eu
program=$1
prove() { # scene, flags
    scene=$1
    shift
    "$program" advise "$scene" --verify --quantity contact_area,mean_gap --error 1%,5%,20% "$@"
}
failed=0
prove configs/measured/unseen.toml --seeds 11,12,13,14,15 || failed=1
prove configs/measured/unseen-rougher.toml || failed=1
prove configs/measured/unseen-shorter.toml || failed=1
prove configs/measured/unseen-adhesion.toml || failed=1
exit $failed
