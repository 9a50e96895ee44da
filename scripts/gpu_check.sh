#!/usr/bin/env bash
# Doctor, fast tests, speed and demo on this machine's GPU; one report in out/gpu.
# Ends with 3 where only a software driver is there; HIZVK_ALLOW_SOFTWARE=1 runs on that.
# `--quick` runs few tests and short measurements, with the tests' own build of the module.
# HIZVK_ADAPTER chooses one of several GPUs.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
quick=
for argument in "$@"; do
  [ "$argument" != --quick ] || quick=1
done
# Without a GPU there is nothing to build for.
status=0
"$VENV_PYTHON" -m tools.gpu_check --only-look || status=$?
[ $status = 0 ] || exit $status
if [ -z "$quick" ]; then
  # The host's work counts in the measurements, so the module is built for release.
  # Without its stamp, the next set-up builds the tests' own module again.
  rm -f "$STAMPS/module"
  step "building the Python module for release (the first time takes some minutes)" \
    env VIRTUAL_ENV="$VENV" PATH="$VENV/bin:$PATH" \
    maturin develop --release --extras viz,scene --features testing,yardstick "${LOCKED[@]}"
fi
exec "$VENV_PYTHON" -m tools.gpu_check "$@"
