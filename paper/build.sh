#!/bin/sh
# Writes paper.html, and paper.pdf where a way to make it is found, into target/paper. Says what is missing.
set -eu
cd "$(dirname "$0")"

out=../target/paper
mkdir -p "$out"
if ! command -v pandoc >/dev/null 2>&1; then
    echo "paper: pandoc is missing; on Debian: apt-get install pandoc. The figures are made: paper/*.png"
    exit 0
fi
# The journal's own numbers of figures are LaTeX; elsewhere they are words.
plain() { sed -e 's/\\autoref{fig:maps}/Figure 1/g; s/\\autoref{fig:challenge}/Figure 2/g; s/\\label{[^}]*}//g; s/^!\[Contact of/![Figure 1. Contact of/; s/^!\[The problem/![Figure 2. The problem/' paper.md; }
plain | pandoc --from markdown --citeproc --standalone --self-contained --resource-path . --metadata lang=en --output "$out/paper.html"
echo "paper: $(cd "$out" && pwd)/paper.html"
for engine in xelatex lualatex weasyprint; do
    if command -v "$engine" >/dev/null 2>&1; then
        plain | sed 's/^!\[Figure [12]\. /![/' | pandoc --from markdown --citeproc --pdf-engine "$engine" --resource-path . --output "$out/paper.pdf"
        echo "paper: $(cd "$out" && pwd)/paper.pdf"
        exit 0
    fi
done
for browser in chromium chromium-browser google-chrome; do
    if command -v "$browser" >/dev/null 2>&1; then
        "$browser" --headless --no-sandbox --disable-gpu --no-pdf-header-footer --print-to-pdf="$out/paper.pdf" "file://$(cd "$out" && pwd)/paper.html" >/dev/null 2>&1
        echo "paper: $(cd "$out" && pwd)/paper.pdf"
        exit 0
    fi
done
echo "paper: no paper.pdf: xelatex, lualatex, weasyprint or a browser is needed"
