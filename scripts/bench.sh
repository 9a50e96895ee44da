#!/usr/bin/env bash
# Speed beside error, for every configuration on scenes with known truth; report and plots are in out/bench. The module is the one that the
# tests use (dependencies optimised, this workspace's crates at opt-level 1): the device's work is the same as in a release build.
# With --speed: times against yardsticks and targets, in out/speed. There the host's work counts too, so the module is built for release.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
if [[ " $* " == *" --speed "* ]]; then
  # Whatever module is left behind, the next set-up makes the tests' own again.
  rm -f "$STAMPS/module"
  step "building the Python module for release (the first time takes some minutes)" \
    env VIRTUAL_ENV="$VENV" PATH="$VENV/bin:$PATH" \
    maturin develop --release --extras viz,scene --features testing,yardstick "${LOCKED[@]}"
fi
step "bench" "$VENV/bin/hizvk" bench "$@"
