#!/usr/bin/env bash
# Sets up what the tests need and runs them all: format, lints, every test (Vulkan on lavapipe with the validation
# layers), the shaders against their sources, and the program itself on the shipped map and on real maps.
set -euo pipefail
cd "$(dirname "$0")/.."

step() { echo "== $*"; }

step "set-up"
bash tests/setup.sh

step "format"
cargo fmt --check

step "lints"
cargo clippy --release --all-targets -- -D warnings

step "tests"
cargo test --release

step "shaders equal the committed SPIR-V"
cargo run --quiet --release --features compile-shaders --bin compile_shaders -- --check

step "smoke"
bash tests/smoke.sh
