#!/usr/bin/env bash
# The packages of the crates (target/package/*.crate) and the sdist.
# Each is unpacked and compiled in an empty folder.
# A package holds no file from above its manifest, so shaders/ is copied beside hiz_core's src/ for
# as long as it takes.
# Everything that is needed has been fetched by a build before: nothing is downloaded.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

export CARGO_NET_OFFLINE=true PATH="$VENV/bin:$PATH"
# The dependencies are compiled once; of the unpacked crates, whose path is new each time, little is
# left behind.
export CARGO_TARGET_DIR="$ROOT/target" CARGO_INCREMENTAL=0

copy=$ROOT/crates/hiz_core/shaders
work=$(mktemp -d)
trap 'rm -rf "$copy" "$work"' EXIT

# The copy is not under version control, so cargo calls the tree dirty.
package() { cargo package --quiet --no-verify --allow-dirty -p hiz_core -p hiz_ref; }

# same_shaders FOLDER: all of them are there, and as they are here.
same_shaders() {
  diff -r "$ROOT/shaders" "$1" || die "other shaders in the package than in shaders/"
}

# compiles FOLDER CRATE ARGUMENT...: the library alone; tests stay in the repository.
compiles() {
  local folder=$1 crate=$2
  shift 2
  (cd "$folder" && cargo check --quiet --lib -p "$crate" "$@")
}

rm -rf "$copy"
cp -r shaders "$copy"
step "packages of the crates" package
rm -rf "$copy"
mkdir "$work/crates"
for crate in target/package/*.crate; do
  tar xzf "$crate" --touch -C "$work/crates"
done
core=("$work"/crates/hiz_core-*)
same_shaders "${core[0]}/shaders"
step "hiz_core out of its package, as a renderer uses it" \
  compiles "${core[0]}" hiz_core --no-default-features --features vulkan
step "hiz_core out of its package" compiles "${core[0]}" hiz_core
step "hiz_ref out of its package" compiles "$work"/crates/hiz_ref-* hiz_ref

step "sdist" maturin sdist --out "$work/dist"
tar xzf "$work"/dist/hizvk-*.tar.gz --touch -C "$work"
sdist=("$work"/hizvk-*)
same_shaders "${sdist[0]}/shaders"
step "hiz_core out of the sdist" \
  compiles "${sdist[0]}" hiz_core --no-default-features --features vulkan
