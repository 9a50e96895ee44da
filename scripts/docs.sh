#!/usr/bin/env bash
# The documentation: all pages and the Python interface by Sphinx, the Rust interface by rustdoc.
# A dead link fails the build.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh docs
sphinx=("$VENV_PYTHON" -m sphinx --fail-on-warning --keep-going -q -b html)
step "Python documentation" "${sphinx[@]}" docs docs/_build/html
# Dependencies are not documented, because that would take minutes.
export RUSTDOCFLAGS="-D warnings"
step "Rust documentation" cargo doc --workspace "${LOCKED[@]}" --no-deps
printf 'open docs/_build/html/index.html and target/doc/hiz_core/index.html\n'
