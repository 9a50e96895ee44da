#!/usr/bin/env bash
# The tests that take minutes:
# - adversarial cases against the exact oracle, a million (HIZVK_SOAK_CASES) for each kind of
#   bounds, from seed HIZVK_SOAK_SEED on;
# - the random tests of `make test` with eight times (HIZVK_SOAK_TIMES) the cases: culls in every
#   mode and in groups, depth that fits, counts of pixels, all cases of planted faults;
# - the certificates in every arithmetic that WGSL permits;
# - the example's scenes with and without culling, by 1000 random cameras (HIZVK_SOAK_CAMERAS) each;
# - the viewer's scenes with and without culling, 300 frames (HIZVK_VIEWER_FRAMES) each;
# - 2000 processes each of Rust and Python that use a device and end;
# - every command of docs/sources.md.
# The adversarial cases may be stopped at any time.
# The next run with the same settings continues there.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
use_test_driver
slow_rust_tests() {
  if have cargo-nextest; then
    cargo nextest run --workspace "${LOCKED[@]}" --run-ignored only --no-capture
  else
    cargo test --workspace "${LOCKED[@]}" --tests -- --ignored --nocapture
  fi
}
slow_python_tests() {
  local status=0
  "$VENV_PYTHON" -m pytest -m slow || status=$?
  # 5: no test is marked slow
  [ "$status" = 5 ] || return "$status"
}
random_rust_tests() {
  export HIZVK_SOAK_TIMES=${HIZVK_SOAK_TIMES:-8}
  if have cargo-nextest; then
    cargo nextest run --workspace "${LOCKED[@]}" --no-fail-fast \
      -E 'binary(differential) | binary(fit_volume) | binary(pixels) | binary(planted_faults)'
  else
    cargo test --workspace "${LOCKED[@]}" --no-fail-fast \
      --test differential --test fit_volume --test pixels --test planted_faults
  fi
}
random_arrays() {
  HIZVK_FUZZ=random "$VENV_PYTHON" -m pytest tests/test_fuzz.py tests/test_fuzz_arrays.py
}
step "slow Rust tests" slow_rust_tests
step "random Rust tests with more cases" random_rust_tests
step "processes that end" "$VENV_PYTHON" scripts/exits.py
step "fuzzing with new examples" random_arrays
step "slow Python tests" slow_python_tests
