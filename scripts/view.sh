#!/usr/bin/env bash
# The viewer: a window on a scene, frames as PNG files (--headless), or a table (--bench).
# `view.sh --help` lists what it takes.
# Intel's castle is one of its scenes where HIZVK_CASTLE names a castle.npz.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
castle=${HIZVK_CASTLE:-}
if [ -n "$castle" ]; then
  [ -f "$castle" ] || die "HIZVK_CASTLE: no such file: $castle"
  export HIZVK_CASTLE_FOLDER=$ROOT/target/castle
  if ! [ "$HIZVK_CASTLE_FOLDER/instance_vertices.npy" -nt "$castle" ]; then
    # An .npz file is a zip archive of arrays, here compressed by LZMA.
    step "unpacking $castle" "$VENV_PYTHON" -m zipfile -e "$castle" "$HIZVK_CASTLE_FOLDER"
    touch "$HIZVK_CASTLE_FOLDER"/*.npy
  fi
fi
# The window is X11's.
unset WAYLAND_DISPLAY
profile=()
for argument in "$@"; do
  # Times are those of a release build.
  [ "$argument" != --bench ] || profile=(--release)
done
# With hiz_py among the packages, the dependencies have the features of the tests' build.
step "building the viewer (the first time takes some minutes)" \
  cargo build --quiet -p hiz_py -p hiz_viewer --bin viewer "${profile[@]}" "${LOCKED[@]}"
folder=debug
[ ${#profile[@]} -eq 0 ] || folder=release
exec "${CARGO_TARGET_DIR:-$ROOT/target}/$folder/viewer" "$@"
