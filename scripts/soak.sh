#!/usr/bin/env bash
# The tests that take minutes. Later: random and adversarial search without an end, on both drivers, with a report of what it tried.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
use_test_driver
cat <<'END'
soak: runs the slow tests that exist. A search without an end (random cameras, bounds and depth images against the float64 oracle, on
      both software drivers, until it is stopped or finds a false cull) comes later.
END

slow_rust_tests() {
  if have cargo-nextest; then
    cargo nextest run --workspace "${LOCKED[@]}" --run-ignored only --no-tests pass
  else
    cargo test --workspace "${LOCKED[@]}" --tests -- --ignored
  fi
}
slow_python_tests() {
  local status=0
  "$VENV_PYTHON" -m pytest -m slow || status=$?
  # 5: no test is marked slow
  [ "$status" = 5 ] || return "$status"
}
step "slow Rust tests" slow_rust_tests
step "slow Python tests" slow_python_tests
