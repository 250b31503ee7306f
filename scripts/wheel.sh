#!/bin/sh
# Builds the Python wheel of asperity: the module and, as a script of the wheel, the program.
#
#   scripts/wheel.sh release OUT [PYTHON]    PYTHON has maturin
#   scripts/wheel.sh dev OUT [PYTHON]
set -eu

profile=$1 out=$2 python=${3:-python3}
case $profile in
release) folder=release && cargo build --quiet --locked --release ;;
# With the features of `make test`: library and program are compiled once for both.
dev) folder=debug && cargo build --quiet --locked -p asperity -p asperity-python --bins --tests ;;
*)
    echo "wheel: profile $profile; accepted: release, dev" >&2
    exit 2
    ;;
esac
mkdir -p python/asperity.data/scripts "$out"
rm -f "$out"/asperity-*.whl
cp "${CARGO_TARGET_DIR:-target}/$folder/asperity" python/asperity.data/scripts/asperity
# Symbols would triple the size of the wheel.
strip python/asperity.data/scripts/asperity
"$python" -m maturin build --quiet --locked --strip --profile "$profile" --manifest-path python/Cargo.toml --out "$out"
