#!/usr/bin/env bash
# check_wheel.sh WHEEL: checks the tag, the symbols, the contents and the dependencies of a wheel.
# Then it runs the wheel in an empty virtual environment outside the checkout, with NumPy alone and
# with the extras.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

wheel=$(realpath "${1:?usage: check_wheel.sh WHEEL}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$VENV_PYTHON" scripts/inspect_wheel.py "$wheel"
# Only functions of Python's stable ABI, each of which Python 3.11 has.
"$VENV_PYTHON" -m abi3audit --strict --verbose "$wheel"

# The tag is the oldest one that the symbols allow.
symbols=$("$VENV_PYTHON" -m auditwheel show "$wheel" | tr '\n' ' ')
tag=$(grep -oE 'platform tag to "[a-z0-9_]+"' <<<"$symbols" | cut -d '"' -f 2)
case $(basename "$wheel") in
  *"-$tag.whl") printf 'auditwheel: the symbols allow %s\n' "$tag" ;;
  *) die "tag: auditwheel finds ${tag:-none}, the wheel is $(basename "$wheel")" ;;
esac

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

# What the messages advise: the line is printed by the installed package, and is run as it is.
line=$(venv/bin/python -I wheel_smoke.py --advice)
[ "$line" = "pip install '${wheel}[viz,scene]'" ] || die "the package advises: $line"
(PATH="$work/venv/bin:$PATH" && eval "$line")
venv/bin/python -I wheel_smoke.py --extras
