#!/usr/bin/env bash
# Makes the sdist and the wheel in dist/.
# The wheel is built from the unpacked sdist alone, which proves that the sdist is complete.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

# Symbols no newer than glibc 2.28 (Debian 10, RHEL 8); zig brings the libraries to link against.
compatibility=manylinux_2_28

scripts/setup.sh wheel
export VIRTUAL_ENV="$VENV" PATH="$VENV/bin:$PATH"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

rm -rf dist
step "sdist" maturin sdist --out dist
sdists=(dist/hizvk-*.tar.gz)
# --touch: the times in an sdist are long past, so cargo would take the crates for those that it
# has compiled before.
tar xzf "${sdists[0]}" --touch -C "$work"

# maturin leaves the viewer out of the sdist's workspace, but not out of its Cargo.lock.
# So cargo drops from the lock file what nobody needs, and must change nothing else.
smaller_lock() {
  (cd "$work"/hizvk-* && cp Cargo.lock ../whole.lock &&
    cargo metadata --offline --format-version 1 >/dev/null &&
    "$VENV_PYTHON" "$ROOT/scripts/same_lock.py" ../whole.lock Cargo.lock)
}

build_wheel() {
  # With this target folder the registry's crates are compiled only once.
  (cd "$work"/hizvk-* && CARGO_TARGET_DIR="$ROOT/target/wheel" \
    maturin build --release --locked --zig --compatibility "$compatibility" --out "$ROOT/dist")
}
step "the sdist's Cargo.lock" smaller_lock
step "wheel out of the sdist" build_wheel
step "its bill of materials" "$VENV_PYTHON" scripts/stable_sbom.py dist/hizvk-*.whl
step "the wheel in an empty virtual environment" scripts/check_wheel.sh dist/hizvk-*.whl
ls -l dist
