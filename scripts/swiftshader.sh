#!/usr/bin/env bash
# Puts SwiftShader, the software Vulkan driver of Chromium, into target/swiftshader/.
# It needs no root: the package is unpacked, not installed.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

dir=$ROOT/target/swiftshader
files=(libvk_swiftshader.so vk_swiftshader_icd.json)
if [ -e "$dir/${files[0]}" ] && [ -e "$dir/${files[1]}" ]; then
  exit 0
fi

if ! have apt-get || ! have dpkg-deb; then
  die "SwiftShader is taken from Debian's package chromium-common" \
    "this system has no apt-get or dpkg-deb" \
    "elsewhere: put ${files[*]} (Chromium ships them) into $dir"
fi

say "SwiftShader, out of Debian's chromium-common"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
# The lists of packages may be missing or old, for instance on a container image.
# Only root can update them.
if ! apt-get download -qq chromium-common 2>"$work/why"; then
  if [ "$(id -u)" = 0 ]; then
    apt-get update -qq </dev/null || true
  elif have sudo && sudo -n true 2>/dev/null; then
    sudo -n apt-get update -qq </dev/null || true
  fi
  apt-get download -qq chromium-common 2>"$work/why" || {
    cat "$work/why" >&2
    die "apt-get has no chromium-common: Debian has it, Ubuntu does not (its Chromium is a snap)" \
      "run this on Debian, or put ${files[*]} from any Chromium into $dir" \
      "if the lists of packages are old: apt-get update"
  }
fi
dpkg-deb --fsys-tarfile chromium-common_*.deb |
  tar x --strip-components=4 "${files[@]/#/./usr/lib/chromium/}"
# The manifest names the library by a path relative to itself, so the two stay together.
mkdir -p "$dir"
mv "${files[@]}" "$dir/"
