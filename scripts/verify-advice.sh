#!/bin/sh
# Runs the settings that `asperity advise` recommends on surfaces that are in no table, and compares errors: five other seeds, two other
# spectra, and a seed with adhesion. $1: the program.
set -eu
program=$1
verify() { # scene, flags
    scene=$1
    shift
    "$program" advise "$scene" --verify --quantity contact_area,mean_gap --error 1%,5%,20% "$@"
}
failed=0
verify configs/measured/unseen.toml --seeds 11,12,13,14,15 || failed=1
verify configs/measured/unseen-rougher.toml || failed=1
verify configs/measured/unseen-shorter.toml || failed=1
verify configs/measured/unseen-adhesion.toml || failed=1
exit $failed
