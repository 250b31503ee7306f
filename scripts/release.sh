#!/usr/bin/env bash
# Builds and checks what a release consists of, in target/release-files, and lists what a person uploads where. It uploads nothing.
# Needs access to crates.io and PyPI, and Cargo 1.90 or newer, which packages a workspace. Half an hour on two cores.
#
#   scripts/release.sh    for glibc 2.28 and newer if python3 has ziglang and cargo-zigbuild, else for the glibc of this machine;
#                         the Debian package if cargo-deb is installed
set -u
cd "$(dirname "$0")/.." || exit 1

out=target/release-files environment=target/release-python fresh=target/release-fresh
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
crates="grid surface contact methods atoms" # each needs those before it
program=python/asperity.data/scripts/asperity
failed=()

# check NAME COMMAND...: the output of a command is shown where it fails.
check() {
    local name=$1 log=$out/log
    shift
    if "$@" >"$log" 2>&1; then
        echo "passed: $name"
    else
        cat "$log"
        echo "FAILED: $name"
        failed+=("$name")
    fi
}

# at_most MB FILE
at_most() {
    local bytes
    bytes=$(stat -c %s "$2") || return 1
    echo "$bytes bytes"
    [ "$bytes" -le $(($1 * 1000 * 1000)) ]
}

is_committed() {
    local changed
    changed=$(git status --porcelain) && echo "$changed" && [ -z "$changed" ]
}

crates() {
    # Cargo takes unpacked and compiled packages of an earlier run for these, which have the same version.
    rm -rf target/release-crates "${CARGO_HOME:-$HOME/.cargo}"/registry/src/-*/asperity-*-"$version"
    cargo package --locked --workspace --exclude asperity-python --target-dir target/release-crates &&
        cp target/release-crates/package/asperity*-"$version".crate "$out"
}

# has_files ARCHIVE NAME...
has_files() {
    local list name archive=$1
    shift
    list=$(tar tzf "$archive") || return 1
    for name in "$@"; do grep -q "^[^/]*/$name\$" <<<"$list" || { echo "no $name"; return 1; }; done
}

builders() {
    python3 -m venv --clear "$environment" && "$environment/bin/python" -m pip install --quiet 'maturin>=1.8,<2' || return 1
    if [ "$profile" = manylinux ]; then "$environment/bin/python" -m pip install --quiet ziglang cargo-zigbuild; fi
}

# Libraries that Debian has in libc6 and libgcc-s1.
needs_libc_only() {
    local needed
    needed=$(readelf -d "$program" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
    [ -n "$needed" ] && echo "$needed" && ! grep -vE '^(libc|libm|libdl|librt|libpthread|libgcc_s|ld-linux-[a-z0-9-]*)\.so' <<<"$needed"
}

debian_package() {
    rm -rf target/deb && scripts/install.sh "$program" target/deb && cargo deb --no-build --no-strip --locked --output "$out/"
}

fresh_environment() {
    python3 -m venv --clear "$fresh" && "$fresh/bin/python" -m pip install "$out"/asperity-"$version"-*.whl
}

prints_version() { [ "$("$fresh/bin/asperity" --version)" = "asperity $version" ]; }

module_has_version() { "$fresh/bin/python" -P -c "import asperity; assert asperity.__version__ == '$version', asperity.__version__"; }

# The commands of the README on the map that it names.
solves() {
    local run=$out/run
    "$fresh/bin/asperity" surface configs/measured-surface.txt --touching high-points --fill harmonic --detrend plane --edges mirror --out "$run/prepared.npy" &&
        "$fresh/bin/asperity" solve "$run/prepared.npy" --modulus 2GPa --pressure log:1MPa:100MPa:5 --out "$run/curve" &&
        [ "$(wc -l <"$run/curve/curve.csv")" -ge 6 ] && rm -r "$run"
}

rm -rf "$out" && mkdir -p "$out/run" || exit 1
profile=release
if python3 -c "import ziglang" 2>/dev/null && command -v cargo-zigbuild >/dev/null 2>&1; then profile=manylinux; fi
echo "asperity $version, wheel: $profile"

check "everything is committed" is_committed
check "crates are packaged and built from their packages" crates
for crate in "" ${crates}; do
    file=$out/asperity${crate:+-$crate}-$version.crate
    check "${file##*/} has LICENSE and README.md" has_files "$file" LICENSE README.md
    check "${file##*/} has at most 10 MB" at_most 10 "$file"
done

check "tools of the wheel are installed" builders
check "wheel and source distribution are built" scripts/wheel.sh "$profile" "$out" "$environment/bin/python"
sdist=$out/asperity-$version.tar.gz
check "wheel has at most 10 MB" at_most 10 "$out"/asperity-"$version"-*.whl
check "source distribution has LICENSE and Cargo.lock" has_files "$sdist" LICENSE Cargo.lock build_program.py
check "source distribution has at most 10 MB" at_most 10 "$sdist"
check "stripped program has at most 15 MB" at_most 15 "$program"
check "program needs libc only" needs_libc_only
if command -v cargo-deb >/dev/null 2>&1; then
    check "Debian package is built" debian_package
else
    echo "NOT BUILT: Debian package: cargo-deb is missing (cargo install cargo-deb --locked)"
fi

check "wheel is installed by pip" fresh_environment
check "asperity --version" prints_version
check "module has the version" module_has_version
check "asperity doctor" "$fresh/bin/asperity" doctor
check "the commands of the README solve" solves
rm -rf "$out/log" "$out/run"

if ((${#failed[@]})); then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
cat <<WORDS

All passed. What a person does, in this order:

1. Enable private vulnerability reports, which SECURITY.md names. Set \`repository\` in Cargo.toml and the crates, \`repository-code\` in CITATION.cff, \`codeRepository\` in codemeta.json and
   \`[project.urls]\` in python/pyproject.toml.
2. Set the date in CHANGELOG.md and CITATION.cff (\`date-released\`), and say in docs/install.md and docs/limitations.md that there is a
   release. Commit, run this script again, and tag: git tag v$version
3. crates.io, in this order, each by cargo publish -p NAME: $(for crate in ${crates}; do printf 'asperity-%s, ' "$crate"; done)asperity
4. PyPI: $(cd "$out" && echo asperity-"$version"-*.whl) and asperity-$version.tar.gz in $out
5. The page of the release: the Debian package, the section of CHANGELOG.md
6. An archive with a DOI (Zenodo), from the tag; then \`doi\` in CITATION.cff and \`identifier\` in codemeta.json
7. conda-forge: packaging/conda/recipe.yaml with the hash of the source distribution on PyPI
WORDS
