#!/bin/sh
# Writes the reference values of tests/solvers/preparation.rs again, with SurfaceTopography from PyPI: prepared maps, Sq, gradients, spectra
# with and without seam and with a Hann window. Twelve decimals may differ by rounding between versions of NumPy; the tests compare ten.
set -eu
cd "$(dirname "$0")/.."
env=$(mktemp -d)
trap 'rm -rf "$env"' EXIT
python3 -m venv "$env"
"$env/bin/pip" install --quiet SurfaceTopography==1.27.1
"$env/bin/python" tests/fixtures/preparation/make.py
git diff --stat -- tests/fixtures/preparation
