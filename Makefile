# For newcomers: `make demo` runs the quickstart, `make test` all tests. Both install what is missing.

# rustup installs cargo here; shells started earlier do not have it on their path.
export PATH := $(PATH):$(HOME)/.cargo/bin

SCENE := configs/quickstart.toml
RUN := runs/quickstart

.PHONY: help demo test bench bench-peers measured verify-advice lint

help:
	@echo "make demo   install, build, run $(SCENE), print the path of the report (a few minutes)"
	@echo "make test   install, then run every test"
	@echo "make bench  run the benchmarks"
	@echo "make bench-peers  compare with Tamaas and ContactMechanics from PyPI (half an hour; PEERS=--quick: minutes)"
	@echo "make measured  write the tables of advise, and docs/trade-off-series.md (an hour on two idle cores)"
	@echo "make verify-advice  compare advice with results on five other seeds and two other spectra (half an hour)"
	@echo "make lint   check formatting and clippy"

demo:
	@scripts/setup.sh
	cargo build --release --locked
	target/release/asperity doctor
	target/release/asperity run $(SCENE) --out $(RUN)
	@echo
	@echo "The report is $(CURDIR)/$(RUN)/report.html: open it in a browser."

test:
	@scripts/setup.sh --tests
	cargo test --locked

bench:
	cargo bench --locked
	cargo build --release --locked
	target/release/asperity bench

bench-peers:
	cargo build --release --locked
	python3 benches/peers/compare.py --asperity target/release/asperity $(PEERS)

measured:
	cargo build --release --locked
	scripts/measure.sh target/release/asperity

verify-advice:
	cargo build --release --locked
	scripts/verify-advice.sh target/release/asperity

lint:
	cargo fmt --check
	cargo clippy --all-targets --locked -- -D warnings
