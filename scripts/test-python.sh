#!/bin/sh
# Builds the Python wheel, installs it in a fresh virtual environment and runs its tests, the examples of its docstrings and mypy.
# `scripts/setup.sh --tests` makes target/python, which has maturin and the packages that the tests use.
set -eu

made=target/python fresh=target/python-wheel wheels=target/wheels
if ! "$made/bin/python" -c "import maturin, pytest" >/dev/null 2>&1; then
    case ",${ASPERITY_REQUIRE-}," in
    *,python,*)
        echo "test-python: target/python is missing or incomplete; scripts/setup.sh --tests creates it where PyPI can be reached" >&2
        exit 1
        ;;
    esac
    echo "The Python package is NOT TESTED: target/python is missing or incomplete." >&2
    exit 0
fi

scripts/wheel.sh dev "$wheels" "$made/bin/python"
# No network: packages of the tests come from target/python, asperity alone from the wheel.
"$made/bin/python" -m venv --clear "$fresh"
site() { "$1/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))'; }
site "$PWD/$made" >"$(site "$fresh")/tests.pth"
"$fresh/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --no-index "$wheels"/asperity-*.whl
pytest() { "$fresh/bin/python" -P -m pytest --quiet -p no:cacheprovider -c python/pyproject.toml "$@"; }
# -P: the current folder is not searched for modules, so that the installed package is tested.
pytest python/tests
pytest --doctest-modules "$(site "$fresh")/asperity"
cd python && "../$made/bin/python" -m mypy --no-error-summary asperity tests
