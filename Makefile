# For newcomers: `make demo` runs the quickstart, `make test` all tests. Both install what is missing.

# rustup installs cargo here; shells started earlier do not have it on their path.
export PATH := $(PATH):$(HOME)/.cargo/bin

SCENE := configs/quickstart.toml
RUN := runs/quickstart

PREFIX ?= $(HOME)/.local
SECONDS ?= 60
INPUTS ?= 100000
DAMAGES ?= 1000
FEATURES ?= cuda
comma := ,

.PHONY: help install wheel manylinux release docs docs-check demo test test-rust test-python test-mpi bench fuzz damage kills bench-peers judge claims errors gallery paper lint msrv deny

help:
	@echo "make install  build, install program, manual pages and completions under PREFIX ($(PREFIX)); DESTDIR is respected"
	@echo "make wheel  build the Python wheel of module and program, and the source distribution, in target/wheels; needs maturin (pip install maturin)"
	@echo "make manylinux  the same for glibc 2.28 and newer (pip install maturin ziglang cargo-zigbuild)"
	@echo "make release  build and check crates, wheel, source distribution and Debian package, and list what a person uploads where"
	@echo "make docs   write docs/scene.schema.json, docs/keys.md, the same of results.json, evidence/tests.md and the documentation site, target/site"
	@echo "make demo   install, build, run $(SCENE), print the path of the report (a few minutes)"
	@echo "make test   install, then run every test; its parts: make test-rust, make test-python, make test-mpi"
	@echo "make bench  run the benchmarks"
	@echo "make bench-peers  compare with Tamaas and ContactMechanics from PyPI (half an hour; PEERS=--quick: minutes)"
	@echo "make judge  judge the fields of asperity, Tamaas and ContactMechanics on six problems, and write evidence/judge.md (half an hour)"
	@echo "make claims  repeat the commands behind the numbers in the documents and compare (ten minutes; ALL=1: hours)"
	@echo "make errors  test how often the stated errors cover the truth, and write evidence/errors.md (half an hour)"
	@echo "make gallery  make the pictures of docs/gallery.md anew, and write the page (some minutes; needs numpy and matplotlib)"
	@echo "make paper  make the figures of paper/paper.md anew, and paper.pdf or paper.html where pandoc is installed"
	@echo "make fuzz   run the fuzzing targets for 60 s each (SECONDS=3600); needs nightly Rust and cargo-fuzz"
	@echo "make damage  read 100000 changed copies of valid files with every reader (INPUTS=1000000), and damage 1000 folders (DAMAGES=10000)"
	@echo "make kills  interrupt every long command, 200 times in all, and compare the results"
	@echo "make lint   check formatting and clippy (FEATURES=cuda,mpi: with MPI, too)"
	@echo "make docs-check  build the reference of the library with warnings as errors"
	@echo "make msrv   check with the oldest Rust that Cargo.toml accepts, which rustup installs"
	@echo "make deny   check licences, sources and advisories of all crates; needs cargo-deny"

install:
	cargo build --release --locked
	scripts/install.sh target/release/asperity "$(DESTDIR)$(PREFIX)"

wheel:
	scripts/wheel.sh release target/wheels

manylinux:
	scripts/wheel.sh manylinux target/wheels

release:
	scripts/release.sh

docs:
	cargo run --locked -- schema > docs/scene.schema.json
	cargo run --locked -- schema --keys > docs/keys.md
	cargo run --locked -- schema --results > docs/results.schema.json
	cargo run --locked -- schema --results --keys > docs/result-keys.md
	scripts/list_tests.py --write evidence/tests.md
	@scripts/setup.sh --tests
	scripts/site.sh target/site

docs-check:
	RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --locked --workspace --exclude asperity-python --lib

demo:
	@scripts/setup.sh
	cargo build --release --locked
	target/release/asperity doctor
	target/release/asperity run $(SCENE) --out $(RUN)
	@echo
	@echo "The report is $(CURDIR)/$(RUN)/report.html: open it in a browser."

# Runs tests after installing what they need. The next one runs where one fails; those that were skipped are listed.
define tests
	@scripts/setup.sh --tests
	@rm -f target/tmp/skipped
	@status=0; $(foreach command,$(1),$($(command)) || status=1;) \
	if [ -s target/tmp/skipped ]; then echo "$$(wc -l < target/tmp/skipped) tests were SKIPPED:"; cat target/tmp/skipped; fi; \
	exit $$status
endef
rust := cargo test --locked --no-fail-fast --workspace
python := scripts/test-python.sh
mpi := scripts/test-mpi.sh

test:
	$(call tests,rust python mpi)

test-rust:
	$(call tests,rust)

test-python:
	$(call tests,python)

test-mpi:
	$(call tests,mpi)

bench:
	cargo bench --locked --bench measure -- times

bench-peers:
	cargo build --release --locked
	python3 benches/peers/compare.py --asperity target/release/asperity $(PEERS)

judge:
	cargo build --release --locked
	python3 benches/judge/judge.py --asperity target/release/asperity --write evidence/judge.md

claims:
	cargo build --release --locked
	scripts/claims.py --asperity target/release/asperity $(if $(ALL),--all)

errors:
	cargo build --release --locked
	@scripts/setup.sh --tests
	scripts/errors.py --asperity target/release/asperity --write evidence/errors.md

gallery:
	cargo build --release --locked
	@scripts/setup.sh --tests
	target/python/bin/python scripts/gallery.py --asperity target/release/asperity

paper:
	cargo build --release --locked
	@scripts/setup.sh --tests
	target/python/bin/python paper/figures.py --asperity target/release/asperity
	paper/build.sh

fuzz:
	scripts/fuzz.sh $(SECONDS)

damage:
	cargo bench --locked --bench measure -- damage --inputs $(INPUTS)
	cargo bench --locked --bench measure -- folders --damages $(DAMAGES)

kills:
	cargo bench --locked --bench measure -- kills $(SMALL)

lint:
	cargo fmt --all --check
	cargo clippy --workspace --all-targets $(if $(FEATURES),--features asperity/$(subst $(comma),$(comma)asperity/,$(FEATURES))) --locked -- -D warnings
	cargo check --locked -p asperity-contact

msrv:
	version=$$(sed -n 's/^rust-version = "\([0-9.]*\)".*/\1/p' Cargo.toml) && \
	rustup toolchain install --profile minimal "$$version" && \
	cargo "+$$version" check --locked --workspace

deny:
	cargo deny --locked check
