#!/bin/sh
# Builds the documentation site from docs/ with the module and program of this tree; executes the tutorials. Warnings are errors.
#
#   scripts/site.sh OUT
set -eu

out=$1
if ! target/python/bin/python -c "import furo, myst_nb, sphinx" >/dev/null 2>&1; then
    echo "site: Sphinx, myst-nb and furo are missing; scripts/setup.sh --tests installs them where PyPI can be reached" >&2
    exit 1
fi
scripts/install-wheel.sh
target/python-wheel/bin/python -P -m sphinx --fail-on-warning --keep-going --quiet docs "$out"
echo "The site is $out/index.html."
