#!/bin/sh
# Runs every target of fuzz/ for a time. Usage: scripts/fuzz.sh [SECONDS [TARGET...]]
set -eu
cd "$(dirname "$0")/.."
seconds=${1:-60}
[ $# -gt 0 ] && shift
if ! command -v cargo-fuzz > /dev/null || ! cargo +nightly --version > /dev/null 2>&1; then
    echo "fuzz: cargo-fuzz or nightly Rust is missing: rustup toolchain install nightly && cargo install cargo-fuzz --locked" >&2
    echo "fuzz: on stable Rust, 'make damage' reads changed copies of the same corpora" >&2
    exit 1
fi
corpus=$PWD/target/fuzz-corpus
cargo bench --locked --bench measure -- damage --inputs 0 --export "$corpus"
for target in ${*:-$(cargo +nightly fuzz list)}; do
    # Valid inputs and what earlier runs added; 512 MB in one piece for each input. With AddressSanitizer on a busy machine
    # a scene takes 2 s; `make damage` holds each input to 2 s of processor time.
    cargo +nightly fuzz run "$target" "$corpus/$target" -- \
        -max_total_time="$seconds" -timeout=20 -malloc_limit_mb=512 -rss_limit_mb=2048 -print_final_stats=1
done
