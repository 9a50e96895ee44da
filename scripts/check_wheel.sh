#!/usr/bin/env bash
# check_wheel.sh WHEEL: checks the tag, the contents and the dependencies of a wheel.
# Then it runs the wheel in an empty virtual environment outside the checkout.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

wheel=$(realpath "${1:?usage: check_wheel.sh WHEEL}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$VENV_PYTHON" scripts/inspect_wheel.py "$wheel"

"$VENV_PYTHON" -m venv "$work/venv" 2>/dev/null ||
  "$VENV_PYTHON" -m virtualenv --quiet "$work/venv"
"$work/venv/bin/python" -m pip install "$wheel"
cp scripts/wheel_smoke.py "$work/"
cd "$work"
icd=$(lavapipe_icd)
if [ -n "$icd" ]; then
  (use_driver "$icd" && venv/bin/python -I wheel_smoke.py)
else
  printf 'lavapipe is not installed: the wheel was not run on a device\n'
fi
(use_driver "$work/no-such-driver.json" && venv/bin/python -I wheel_smoke.py --no-driver)
