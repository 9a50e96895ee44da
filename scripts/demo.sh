#!/usr/bin/env bash
# The demo on the best adapter of this machine: a GPU comes before a software driver.
# Pictures and report are in out/.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
step "demo" "$VENV/bin/hizvk" demo "$@"
say "note: the module in .venv is a development build, whose uploads take longer"
printf '   make wheel builds the one to measure or to use; hizvk doctor tells them apart\n'
