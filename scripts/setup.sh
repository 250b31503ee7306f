#!/bin/sh
# Installs the dependencies of asperity besides Rust on Debian 12 (and derivatives): a C compiler, because one dependency is C, and
# LAMMPS. Not interactive. Uses neither apt nor the network if everything is installed.
#
#   scripts/setup.sh           fails without LAMMPS
#   scripts/setup.sh --tests   prints a prominent message without LAMMPS and continues: its tests are skipped; also creates a Python
#                              environment with the readers of results.nc and of frames, and installs Chromium for the tests of the report
#                              and Slurm for those of sweeps on a cluster, MPI and libclang for those of several ranks, and qemu for
#                              those of other processors; continues without them, too
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
    echo "setup: cargo was not found; install Rust from https://rustup.rs" >&2
    exit 1
fi

# Readers of results.nc and of frames (tests/readers/python.rs), and what the Python package is built and tested with
# (scripts/test-python.sh); under target/, so that `cargo clean` removes it.
python=target/python
python_packages="ase ContactMechanics furo h5py h5netcdf hypothesis jsonschema matplotlib maturin mypy myst-nb netCDF4 pandas pandas-stubs pytest pytest-xdist Sphinx SurfaceTopography tamaas tqdm xarray"
python_modules="ase, ContactMechanics, furo, h5py, h5netcdf, hypothesis, jsonschema, matplotlib, maturin, mypy, myst_nb, netCDF4, pandas, pytest, sphinx, xdist, SurfaceTopography, tamaas, tqdm, xarray"
has_python() { "$python/bin/python" -c "from importlib.util import find_spec; assert all(map(find_spec, '$python_modules'.split(', ')))" >/dev/null 2>&1; }
has_venv() { has python3 && python3 -c "import venv, ensurepip" >/dev/null 2>&1; }
wants_python() { [ "$need_lammps" = no ] && ! has_python; }

# OVITO reads the frames in the same tests; in an environment of its own, because it needs Qt.
ovito=target/ovito
ovito_packages="ovito PySide6_Essentials shiboken6 traits numpy"
qt_libraries="libdbus-1-3 libegl1 libfontconfig1 libgl1 libglib2.0-0 libgssapi-krb5-2 libxkbcommon0"
has_ovito() { "$ovito/bin/python" -c "import ovito.io" >/dev/null 2>&1; }
wants_ovito() { [ "$need_lammps" = no ] && ! has_ovito; }

has_browser() { has chromium || has chromium-browser || has google-chrome; }
wants_browser() { [ "$need_lammps" = no ] && ! has_browser; }

# Accessibility rules for the report in the browser (tests/report/browser.rs); under target/ like the Python environment.
axe=target/axe
axe_version=4.14.1
has_axe() { [ -f "$axe/node_modules/axe-core/axe.min.js" ]; }
wants_axe() { [ "$need_lammps" = no ] && ! has_axe; }

# A Slurm of two nodes for the tests of sweeps on a cluster (tests/common/slurm.sh).
slurm_packages="slurmctld slurmd slurm-client munge"
has_slurm() {
    for daemon in slurmctld slurmd munged; do has "$daemon" || [ -x "/usr/sbin/$daemon" ] || return 1; done
    has sbatch
}
wants_slurm() { [ "$need_lammps" = no ] && ! has_slurm; }

# The build with the feature mpi (scripts/test-mpi.sh): a library of MPI, its launcher, and libclang, which reads its header.
mpi_packages="libopenmpi-dev openmpi-bin libclang-dev"
has_libclang() { find /usr/lib /usr/local/lib -name 'libclang*.so*' 2>/dev/null | grep -q .; }
has_mpi() { has mpicc && has mpirun && has_libclang; }
wants_mpi() { [ "$need_lammps" = no ] && ! has_mpi; }

# The emulator for the test of results on other processors (tests/program/processors.rs).
has_qemu() { has qemu-x86_64 || has qemu-x86_64-static; }
wants_qemu() { [ "$need_lammps" = no ] && [ "$(uname -m)" = x86_64 ] && ! has_qemu; }

packages=""
wants_qemu && packages="$packages qemu-user"
wants_mpi && packages="$packages $mpi_packages"
wants_slurm && packages="$packages $slurm_packages"
wants_browser && packages="$packages chromium"
wants_axe && ! has npm && packages="$packages npm"
wants_python && ! has_venv && packages="$packages python3-venv"
wants_ovito && packages="$packages $qt_libraries"
has_compiler || packages="$packages build-essential"
has_lammps || packages="$packages lammps"

# Runs a command as root; fails instead of asking for a password.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

install() {
    if ! has apt-get; then
        echo "setup: apt-get was not found" >&2
        return 1
    fi
    if [ "$(id -u)" -ne 0 ] && ! { has sudo && sudo -n true 2>/dev/null; }; then
        echo "setup: installation requires root or sudo without a password" >&2
        return 1
    fi
    # The package lists of a fresh image are empty; an unreachable source must not prevent installation from the others.
    as_root env DEBIAN_FRONTEND=noninteractive apt-get update -qq || echo "setup: apt-get update failed; continuing" >&2
    # One by one, so that an unavailable package does not prevent the others.
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
    echo "setup: creating $python with $python_packages" >&2
    # `pip` itself names the folder in which it was created, which is another one after a copy of target/.
    # shellcheck disable=SC2086 # a list of words
    python3 -m venv "$python" && "$python/bin/python" -m pip install --quiet --disable-pip-version-check $python_packages ||
        echo "setup: $python could not be created" >&2
fi

if wants_ovito && has_venv; then
    echo "setup: creating $ovito with $ovito_packages" >&2
    # Without the dependencies of the package, most of which draw.
    # shellcheck disable=SC2086 # a list of words
    python3 -m venv "$ovito" && "$ovito/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps $ovito_packages ||
        echo "setup: $ovito could not be created" >&2
fi

if wants_axe && has npm; then
    echo "setup: installing axe-core $axe_version into $axe" >&2
    npm install --silent --no-audit --no-fund --prefix "$axe" "axe-core@$axe_version" ||
        echo "setup: axe-core could not be installed" >&2
fi

if ! has_compiler; then
    echo "setup: no C compiler (cc, ar); on Debian: apt-get install build-essential" >&2
    exit 1
fi
if wants_python; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  The Python environment target/python could not be created: THE PYTHON    ***
***  PACKAGE AND READING results.nc AND FRAMES ARE NOT TESTED, or fail if the ***
***  environment exists without one of the packages.                          ***
***  On Debian: apt-get install python3-venv, and access to PyPI              ***
*********************************************************************************

WORDS
fi
if wants_ovito; then
    # Half an environment would be a failure of the tests.
    rm -rf "$ovito"
    cat >&2 <<'WORDS'

*********************************************************************************
***  OVITO could not be installed: READING FRAMES IN OVITO IS NOT TESTED.     ***
***  On Debian: apt-get install libegl1 libgl1, and access to PyPI            ***
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
if wants_axe; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  axe-core is missing and could not be installed: THE ACCESSIBILITY OF THE ***
***  REPORT IS NOT TESTED. On Debian: apt-get install npm, and access to npm  ***
*********************************************************************************

WORDS
fi
if wants_slurm; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  Slurm is missing and could not be installed: SWEEPS ON A CLUSTER ARE NOT ***
***  TESTED. On Debian: apt-get install slurmctld slurmd slurm-client munge   ***
*********************************************************************************

WORDS
fi
if wants_mpi; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  MPI or libclang is missing and could not be installed: SOLVES ON SEVERAL ***
***  RANKS ARE NOT TESTED.                                                    ***
***  On Debian: apt-get install libopenmpi-dev openmpi-bin libclang-dev       ***
*********************************************************************************

WORDS
fi
if has_lammps; then
    if wants_mpi || wants_slurm || wants_python || wants_ovito || wants_browser || wants_axe; then :; else echo "setup: everything is installed" >&2; fi
elif [ "$need_lammps" = no ]; then
    cat >&2 <<'WORDS'

*********************************************************************************
***  LAMMPS is missing and could not be installed.                            ***
***  EVERY TEST THAT NEEDS IT IS SKIPPED: the atoms are not tested.           ***
***  On Debian: apt-get install lammps                                        ***
*********************************************************************************

WORDS
else
    echo "setup: LAMMPS (lmp) is missing and could not be installed; on Debian: apt-get install lammps" >&2
    exit 1
fi
