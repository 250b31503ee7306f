#!/bin/sh
# Builds the Python wheel in the profile of development and installs it in a fresh virtual environment, target/python-wheel, which finds all
# other packages in target/python (`scripts/setup.sh --tests` makes it). No network.
#
#   scripts/install-wheel.sh    exit code 1 if target/python is missing or incomplete
set -eu

made=target/python fresh=target/python-wheel wheels=target/wheels
if ! "$made/bin/python" -c "import maturin" >/dev/null 2>&1; then
    echo "install-wheel: target/python is missing or incomplete; scripts/setup.sh --tests creates it where PyPI can be reached" >&2
    exit 1
fi
scripts/wheel.sh dev "$wheels" "$made/bin/python"
"$made/bin/python" -m venv --clear "$fresh"
site() { "$1/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))'; }
site "$PWD/$made" >"$(site "$fresh")/tests.pth"
"$fresh/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-index "$wheels"/asperity-*.whl
