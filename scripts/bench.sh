#!/usr/bin/env bash
# Speed beside error, for every configuration on scenes with known truth.
# Report and plots are in out/bench.
# The module is the one that the tests use: dependencies optimised, this workspace's crates at
# opt-level 1.
# The device's work is the same as in a release build.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
# The castle's file is not part of the checkout; it may lie beside it.
castle=../shared/judge/castle.npz
if [ -z "${HIZVK_CASTLE:-}" ] && [ -e "$castle" ]; then
  export HIZVK_CASTLE=$castle
fi
step "bench" "$VENV/bin/hizvk" bench "$@"
