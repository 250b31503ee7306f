#!/bin/sh
# What asperity needs besides Rust, on Debian 12 (and its relatives): a C compiler, because one dependency is C, and
# LAMMPS. Asks nothing. Where everything is there already it touches neither apt nor the network.
#
#   scripts/setup.sh           LAMMPS must be there in the end
#   scripts/setup.sh --tests   without LAMMPS it says so loudly and goes on: those tests skip themselves
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

packages=""
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

if ! has_compiler; then
    echo "setup: no C compiler (cc, ar); on Debian: apt-get install build-essential" >&2
    exit 1
fi
if has_lammps; then
    echo "setup: everything is there" >&2
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
