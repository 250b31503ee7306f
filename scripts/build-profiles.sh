#!/usr/bin/env bash
# Cost of the candidates for the profiles of Cargo.toml: processor and wall seconds of a first build, bytes of the program, and
# processor seconds of one solve (least of five, in turns). Each build has a target folder of its own.
#   scripts/build-profiles.sh FOLDER [name...]
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:?"a folder for the builds"}
shift
names=("${@:-dev dev-all-3 release release-thin release-fat release-one-unit}")
read -ra names <<<"${names[*]}"

# Arguments of cargo for a candidate.
arguments() {
    case $1 in
    dev) ;;
    dev-all-3) echo "--config profile.dev.package.'*'.opt-level=3" ;;
    dev-all-1) echo "--config profile.dev.package.'*'.opt-level=1" ;;
    release) echo "--release" ;;
    release-thin) echo "--release --config profile.release.lto='thin'" ;;
    release-fat) echo "--release --config profile.release.lto='fat'" ;;
    release-one-unit) echo "--release --config profile.release.codegen-units=1" ;;
    *) echo "$1 is no candidate" >&2 && exit 2 ;;
    esac
}

program() {
    local kind=debug
    [[ $1 == release* ]] && kind=release
    echo "$folder/$1/$kind/asperity"
}

cargo fetch --locked --quiet
TIMEFORMAT='%R %U %S'
for name in "${names[@]}"; do
    rm -rf "${folder:?}/$name"
    # Quotes inside the arguments belong to TOML.
    read -ra extra <<<"$(arguments "$name" | sed "s/'/\"/g")"
    read -r wall user sys < <({ time cargo build --locked --quiet --target-dir "$folder/$name" "${extra[@]}" >&2 2>/dev/null; } 2>&1)
    printf '%-18s build: %.0f s, %.0f s of processor; program: %.1f MB\n' "$name" "$wall" \
        "$(awk "BEGIN { print $user + $sys }")" "$(awk "BEGIN { print $(stat -c %s "$(program "$name")") / 1e6 }")"
done

heights=$folder/heights.npy
"$(program "${names[0]}")" surface --grid 1024 --out "$heights" >/dev/null 2>&1
declare -A least
for _ in 1 2 3 4 5; do
    for name in "${names[@]}"; do
        read -r _ user sys < <({ time "$(program "$name")" solve "$heights" --modulus 25MPa --p-star 0.01 --threads 1 >/dev/null 2>&1; } 2>&1)
        least[$name]=$(awk "BEGIN { s = $user + $sys; l = ${least[$name]:-1e9}; print s < l ? s : l }")
    done
done
for name in "${names[@]}"; do printf '%-18s solve: %.3f s of processor\n' "$name" "${least[$name]}"; done
