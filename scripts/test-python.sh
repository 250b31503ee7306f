#!/bin/sh
# Tests of the Python package in a fresh virtual environment: its tests, the examples of its docstrings, mypy.
set -eu

made=target/python fresh=target/python-wheel
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

scripts/install-wheel.sh
# -P: the current folder is not searched for modules, so that the installed package is tested.
pytest() { "$fresh/bin/python" -P -m pytest --quiet -p no:cacheprovider -c python/pyproject.toml "$@"; }
pytest -n "$(nproc)" --dist loadfile python/tests
pytest --doctest-modules "$("$fresh/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/asperity"
cd python && "../$made/bin/python" -m mypy --no-error-summary asperity tests
