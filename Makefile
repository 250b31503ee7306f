# Everything a newcomer needs: `make demo` shows it, `make test` proves it. Both do their own set-up.

# rustup puts cargo here; shells that have not been restarted since do not know.
export PATH := $(PATH):$(HOME)/.cargo/bin

SCENE := configs/quickstart.toml
RUN := runs/quickstart

.PHONY: help demo test bench bench-peers measured advice-proof lint

help:
	@echo "make demo   set up, build, run $(SCENE), say where the report is (a few minutes)"
	@echo "make test   set up, then every test"
	@echo "make bench  the benchmarks"
	@echo "make bench-peers  against Tamaas and ContactMechanics from PyPI (half an hour; PEERS=--quick: minutes)"
	@echo "make measured  the tables that advise reads, and the ladders of docs/trade-off-ladders.md (an hour on two idle cores)"
	@echo "make advice-proof  advice against what is found on five other seeds and two other spectra (half an hour)"
	@echo "make lint   formatting and clippy"

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

advice-proof:
	cargo build --release --locked
	scripts/prove-advice.sh target/release/asperity

lint:
	cargo fmt --check
	cargo clippy --all-targets --locked -- -D warnings
