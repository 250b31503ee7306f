#!/bin/sh
# Tests of `solve` on several ranks, in a build with the feature `mpi`. The packages are those of `make test`, so that their dependencies
# have the same features and only the crates of the workspace and the bindings of MPI are compiled. Afterwards target/debug/asperity is the
# program with MPI.
set -eu

missing=""
command -v mpicc >/dev/null 2>&1 && command -v mpirun >/dev/null 2>&1 || missing="an MPI library (libopenmpi-dev, openmpi-bin)"
# Where bindgen searches, too.
find /usr/lib /usr/local/lib ${LIBCLANG_PATH-} -name 'libclang*.so*' 2>/dev/null | grep -q . || missing="${missing:+$missing and }libclang (libclang-dev)"
if [ -n "$missing" ]; then
    case ",${ASPERITY_REQUIRE-}," in
    *,mpi,*)
        echo "test-mpi: $missing is missing; scripts/setup.sh --tests installs it on Debian" >&2
        exit 1
        ;;
    esac
    echo "Several ranks are NOT TESTED: $missing is missing." >&2
    mkdir -p target/tmp
    echo "scripts/test-mpi.sh: $missing is missing" >>target/tmp/skipped
    exit 0
fi
cargo test --locked --workspace --features asperity/mpi --test mpi
