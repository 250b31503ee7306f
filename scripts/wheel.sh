#!/bin/sh
# Builds the Python wheel of asperity: the module and, as a script of the wheel, the program.
#
#   scripts/wheel.sh release OUT [PYTHON]      for the glibc of this machine and newer ones, and the source distribution; PYTHON has maturin
#   scripts/wheel.sh manylinux OUT [PYTHON]    likewise for glibc 2.28 and newer: PYTHON has ziglang and cargo-zigbuild, too
#   scripts/wheel.sh dev OUT [PYTHON]
set -eu

profile=$1 out=$2 python=${3:-python3} target=${CARGO_TARGET_DIR:-target}
arguments="--profile $profile"
# Both packages, whose dependencies then have the features with which maturin compiles the module: one compilation serves both.
packages="-p asperity -p asperity-python --bin asperity"
# shellcheck disable=SC2086 # lists of words
case $profile in
release) program=$target/release/asperity && cargo build --quiet --locked --release $packages ;;
manylinux)
    # cargo-zigbuild is a script of the environment.
    PATH=$("$python" -c 'import sysconfig; print(sysconfig.get_path("scripts"))'):$PATH
    triple=$(rustc -vV | sed -n 's/^host: //p')
    cargo zigbuild --quiet --locked --release $packages --target "$triple.2.28"
    program=$target/$triple/release/asperity arguments="--release --zig --compatibility manylinux_2_28 --target $triple"
    ;;
# With the features of `make test`: library and program are compiled once for both.
dev) program=$target/debug/asperity && cargo build --quiet --locked --workspace --bins --tests ;;
*)
    echo "wheel: profile $profile; accepted: release, manylinux, dev" >&2
    exit 2
    ;;
esac
mkdir -p python/asperity.data/scripts "$out"
rm -f "$out"/asperity-*.whl "$out"/asperity-*.tar.gz
cp "$program" python/asperity.data/scripts/asperity
# Symbols would triple the size of the wheel.
strip python/asperity.data/scripts/asperity
# shellcheck disable=SC2086 # a list of words
"$python" -m maturin build --quiet --locked --strip $arguments --manifest-path python/Cargo.toml --out "$out"
if [ "$profile" != dev ]; then
    "$python" -m maturin sdist --manifest-path python/Cargo.toml --out "$out"
fi
