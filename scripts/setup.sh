#!/bin/sh
# What asperity needs besides Rust, on Debian 12 (and its relatives): a C compiler, because one dependency is C, and
# LAMMPS. Asks nothing. Where everything is there already it touches neither apt nor the network.
#
#   scripts/setup.sh           LAMMPS must be there in the end
#   scripts/setup.sh --tests   without LAMMPS it says so loudly and goes on: those tests skip themselves; makes a Python
#                              environment beside it, with what opens results.nc, and installs Chromium, in which the report
#                              is looked at, and says the same without them
set -eu

case "${1-}" in
"") need_lammps=yes ;;
--tests) need_lammps=no ;;
*)
    echo "setup: unknown option $1; accepted: --tests" >&2
    exit 2
    ;;
esac

has() { command -v "$1" >/dev/null 2>&1; }
has_lammps() { has lmp || has lammps; }
has_compiler() { has cc && has ar; }

if ! has cargo; then
    echo "setup: cargo was not found; Rust comes from https://rustup.rs" >&2
    exit 1
fi

# What opens results.nc as its readers would (tests/readers/python.rs); kept under target/, where `cargo clean` finds it.
python=target/python
python_packages="h5py h5netcdf netCDF4 xarray"
has_python() { "$python/bin/python" -c "import h5py, h5netcdf, netCDF4, xarray" >/dev/null 2>&1; }
has_venv() { has python3 && python3 -c "import venv, ensurepip" >/dev/null 2>&1; }
wants_python() { [ "$need_lammps" = no ] && ! has_python; }

has_browser() { has chromium || has chromium-browser || has google-chrome; }
wants_browser() { [ "$need_lammps" = no ] && ! has_browser; }

packages=""
wants_browser && packages="$packages chromium"
wants_python && ! has_venv && packages="$packages python3-venv"
has_compiler || packages="$packages build-essential"
has_lammps || packages="$packages lammps"

# Runs a command with the superuser's rights, and fails rather than ask for a password.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

install() {
    if ! has apt-get; then
        echo "setup: there is no apt-get here" >&2
        return 1
    fi
    if [ "$(id -u)" -ne 0 ] && ! { has sudo && sudo -n true 2>/dev/null; }; then
        echo "setup: installing needs root, or sudo that asks for no password" >&2
        return 1
    fi
    # The lists of a fresh image are empty; one unreachable source must not stop what the others can give.
    as_root env DEBIAN_FRONTEND=noninteractive apt-get update -qq || echo "setup: apt-get update failed; trying on" >&2
    # Each for itself, so that one that cannot be had does not keep away the other.
    for package in "$@"; do
        as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$package" </dev/null ||
            echo "setup: $package could not be installed" >&2
    done
}

if [ -n "$packages" ]; then
    echo "setup: installing$packages" >&2
    # shellcheck disable=SC2086 # a list of words
    install $packages || true
fi

if wants_python && has_venv; then
    echo "setup: making $python with $python_packages" >&2
    # shellcheck disable=SC2086 # a list of words
    python3 -m venv "$python" && "$python/bin/pip" install --quiet --disable-pip-version-check $python_packages ||
        echo "setup: $python could not be made" >&2
fi

if ! has_compiler; then
    echo "setup: no C compiler (cc, ar); on Debian: apt-get install build-essential" >&2
    exit 1
fi
if wants_python; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  No Python environment with h5py, h5netcdf, netCDF4 and xarray could be   ***
***  made in target/python: WHAT results.nc IS TO PYTHON IS NOT TESTED.       ***
***  On Debian: apt-get install python3-venv, and a way to PyPI               ***
*********************************************************************************

WORDS
fi
if wants_browser; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  Chromium is missing and could not be installed: THE REPORT IS NOT TESTED ***
***  IN A BROWSER. On Debian: apt-get install chromium                        ***
*********************************************************************************

WORDS
fi
if has_lammps; then
    if wants_python || wants_browser; then :; else echo "setup: everything is there" >&2; fi
elif [ "$need_lammps" = no ]; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  LAMMPS is missing and could not be installed.                            ***
***  EVERY TEST THAT NEEDS IT IS SKIPPED: what passes below says nothing      ***
***  about atoms. On Debian: apt-get install lammps                           ***
*********************************************************************************

WORDS
else
    echo "setup: LAMMPS (lmp) is missing and could not be installed; on Debian: apt-get install lammps" >&2
    exit 1
fi
