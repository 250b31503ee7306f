#!/bin/sh
# Runs the settings that `asperity advise` recommends on surfaces that are in no table, and compares errors: five other seeds, two other
# spectra, and a seed with adhesion.
set -eu
verify() { # scene, flags
    scene=$1
    shift
    cargo bench --locked --bench measure -- verify-advice "$scene" --quantity contact_area,mean_gap --error 0.01,0.05,0.2 "$@"
}
failed=0
verify configs/measured/unseen.toml --seeds 11,12,13,14,15 || failed=1
verify configs/measured/unseen-rougher.toml || failed=1
verify configs/measured/unseen-shorter.toml || failed=1
verify configs/measured/unseen-adhesion.toml || failed=1
exit $failed
