#!/usr/bin/env bash
# test.sh [lavapipe | swiftshader]: the Rust and the Python tests on one software driver.
# The driver's name is printed and checked first.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

driver=${1:-lavapipe}
started=$SECONDS

scripts/setup.sh
case $driver in
  lavapipe) use_test_driver ;;
  swiftshader)
    scripts/swiftshader.sh
    use_driver "$ROOT/target/swiftshader/vk_swiftshader_icd.json"
    export HIZVK_EXPECT_ADAPTER=SwiftShader
    ;;
  *) die "driver: expected lavapipe or swiftshader, got $driver" ;;
esac

say "the adapter under test"
"$VENV_PYTHON" tests/adapter_check.py

# Always the whole workspace: a smaller selection has other features in some dependencies, so wgpu
# would be compiled again.
rust_tests() {
  # A debug build of wgpu takes a backtrace at each lock where RUST_BACKTRACE is set.
  # That is a tenth of the time of these tests. Panics keep their backtraces.
  export RUST_LIB_BACKTRACE=0
  if have cargo-nextest; then
    cargo nextest run --workspace "${LOCKED[@]}" --no-fail-fast
  else
    cargo test --workspace "${LOCKED[@]}" --no-fail-fast --tests --examples
  fi
}
check "Rust tests" rust_tests
check "Rust documentation tests" cargo test --workspace "${LOCKED[@]}" --doc --quiet
if [ "$driver" = swiftshader ] && [ -n "$(lavapipe_icd)" ]; then
  both=$ROOT/target/swiftshader/vk_swiftshader_icd.json:$(lavapipe_icd)
  check "verdicts of both drivers" env VK_DRIVER_FILES="$both" VK_ICD_FILENAMES="$both" \
    cargo test --workspace "${LOCKED[@]}" --test drivers -- --nocapture
fi
# A process for each core, and each file in one of them, because a file's tests share its device.
check "Python tests" "$VENV_PYTHON" -m pytest -m "not slow" \
  --numprocesses=auto --maxprocesses=4 --dist=loadfile
check "processes that end" "$VENV_PYTHON" scripts/exits.py --rust 60 --python 15
check "packages" scripts/package.sh
printf -- '-- all tests on %s: %d s\n' "$driver" $((SECONDS - started))
checked
