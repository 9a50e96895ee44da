#!/usr/bin/env bash
# Benchmarks. Later: milliseconds of pyramid, cull and readback over sizes and counts, with a table to compare two revisions.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

cat <<'END'
bench: comes later. It will time pyramid, cull, compaction and readback over image sizes and instance counts in a release build, each
       beside its effectiveness (kept, hidden, wrongly kept), and compare two revisions.
       Until then `make demo` prints the milliseconds of each stage on a real scene.
END
