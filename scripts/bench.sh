#!/usr/bin/env bash
# Speed beside error, for every configuration on scenes with known truth; report and plots are in out/bench. The module is the one that the
# tests use (dependencies optimised, this workspace's crates at opt-level 1): the device's work is the same as in a release build.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
step "bench" "$VENV/bin/hizvk" bench "$@"
