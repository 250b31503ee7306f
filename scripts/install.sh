#!/bin/sh
# Installs the program, its manual pages and its completions: scripts/install.sh PROGRAM PREFIX
set -eu

if [ $# -ne 2 ] || [ ! -x "$1" ]; then
    echo "install: usage: scripts/install.sh PROGRAM PREFIX (make install builds the program first)" >&2
    exit 2
fi
program=$1
prefix=$2

# The completions of a shell, where that shell looks for them.
completions() {
    mkdir -p "$prefix/share/$(dirname "$2")"
    "$program" completions "$1" >"$prefix/share/$2"
    echo "$1 completions: $prefix/share/$2"
}

mkdir -p "$prefix/bin" "$prefix/share/man/man1"
install -m 755 "$program" "$prefix/bin/asperity"
echo "program: $prefix/bin/asperity"
"$program" man --out "$prefix/share/man/man1" >/dev/null
echo "manual pages: $prefix/share/man/man1 (man asperity, man asperity-run)"
completions bash bash-completion/completions/asperity
completions zsh zsh/site-functions/_asperity
completions fish fish/vendor_completions.d/asperity.fish
case ":$PATH:" in
*":$prefix/bin:"*) ;;
*) echo "$prefix/bin is not on the PATH: export PATH=\"\$PATH:$prefix/bin\"" ;;
esac
