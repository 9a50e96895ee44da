#!/usr/bin/env bash
# Times against yardsticks and targets; report and plot are in out/speed.
# The host's work counts here, so the module is built for release.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
# Without its stamp, the next set-up builds the tests' own module again.
rm -f "$STAMPS/module"
step "building the Python module for release (the first time takes some minutes)" \
  env VIRTUAL_ENV="$VENV" PATH="$VENV/bin:$PATH" \
  maturin develop --release --extras viz,scene --features testing,yardstick "${LOCKED[@]}"
step "speed" "$VENV_PYTHON" -m tools.speed "$@"
