#!/usr/bin/env bash
# Installs and builds what `make demo` and `make test` need, on a Debian or Ubuntu with Rust and
# Python.
# It is idempotent, and quick when all is there.
# `setup.sh GROUP...` also installs those dependency groups of pyproject.toml (docs, wheel).
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source scripts/browser.sh

# -- system packages -------------------------------------------------------------------------------

# Prints the first interpreter that is new enough.
find_python() {
  local candidate new_enough='import sys; sys.exit(sys.version_info < (3, 11))'
  for candidate in ${PYTHON:+"$PYTHON"} \
    python3 python3.14 python3.13 python3.12 python3.11 /usr/bin/python3; do
    if have "$candidate" && "$candidate" -c "$new_enough" 2>/dev/null; then
      command -v "$candidate"
      return
    fi
  done
}

can_make_venv() { "$1" -c 'import ensurepip, venv' 2>/dev/null; }

has_vulkan_loader() {
  local file
  for file in /usr/lib{/*,64,}/libvulkan.so.1 /usr/local/lib/libvulkan.so.1; do
    [ -e "$file" ] && return
  done
  return 1
}

has_vulkan_driver() {
  compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null ||
    compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null
}

# Whether commands can be run as root without a password; as_root then precedes them.
as_root=()
can_be_root() {
  [ "$(id -u)" != 0 ] || return 0
  have sudo && sudo -n true 2>/dev/null && as_root=(sudo -n)
}

# apt_install PACKAGE...: installs them, or names the exact line to run and ends.
apt_install() {
  local line="apt-get update && apt-get install -y $*"
  have apt-get || die "these Debian packages, or what your system calls them, are missing: $*"
  can_be_root || die "system packages are missing and this user may not install them; run:" \
    "sudo sh -c '$line'" "and then make again"
  say "installing system packages: $*"
  # An unreachable third-party source fails the update, but the packages may still be available.
  "${as_root[@]}" apt-get update -qq </dev/null ||
    printf 'warning: apt-get update failed; trying with the lists at hand\n' >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "$@" </dev/null ||
    die "apt-get could not install: $*" "run it by hand to see why: $line"
}

system_packages() {
  local missing=() python version
  has_vulkan_loader || missing+=(libvulkan1)
  [ -n "$(lavapipe_icd)" ] || missing+=(mesa-vulkan-drivers)
  # rustc links through cc.
  have cc || missing+=(gcc libc6-dev)
  python=$(find_python)
  if [ -z "$python" ]; then
    missing+=(python3 python3-venv)
  elif ! [ -x "$VENV_PYTHON" ] && ! can_make_venv "$python" &&
    ! "$python" -c 'import virtualenv' 2>/dev/null; then
    version=$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')
    case $(readlink -f "$python") in
      /usr/bin/*) missing+=("$version-venv") ;;
      *)
        die "$python has neither ensurepip nor virtualenv" \
          "run: $python -m pip install virtualenv, or name another one with PYTHON="
        ;;
    esac
  fi
  # The tests want lavapipe, the demo wants any driver.
  if [ "${missing[*]}" = mesa-vulkan-drivers ] && ! can_be_root && has_vulkan_driver; then
    printf 'note: no lavapipe (mesa-vulkan-drivers), which the tests run on; %s\n' \
      'going on with the Vulkan driver that is there' >&2
    return
  fi
  [ ${#missing[@]} -eq 0 ] || apt_install "${missing[@]}"
}

has_library() {
  local file
  for file in /usr/lib{/*,64,}/"$1" /usr/local/lib/"$1"; do
    [ -e "$file" ] && return
  done
  return 1
}

# What the viewer's window needs, and its test: an X server without a screen, and keys for it.
# The test skips itself without them, so nothing ends here.
window_packages() {
  local missing=() pair line
  for pair in Xvfb:xvfb xdotool:xdotool; do
    have "${pair%%:*}" || missing+=("${pair#*:}")
  done
  for pair in libX11.so.6:libx11-6 libX11-xcb.so.1:libx11-xcb1 libXcursor.so.1:libxcursor1 \
    libXi.so.6:libxi6 libXrandr.so.2:libxrandr2 libxkbcommon-x11.so.0:libxkbcommon-x11-0; do
    has_library "${pair%%:*}" || missing+=("${pair#*:}")
  done
  # What could not be installed once is not tried again.
  if [ ${#missing[@]} -eq 0 ] || [ "${missing[*]}" = "$(cat "$STAMPS/window" 2>/dev/null)" ]; then
    return
  fi
  printf '%s\n' "${missing[*]}" >"$STAMPS/window"
  line="apt-get update && apt-get install -y ${missing[*]}"
  if ! have apt-get || ! can_be_root || ! (apt_install "${missing[@]}"); then
    printf 'note: the test of the window is skipped without these packages: %s\n' \
      "sudo sh -c '$line'" >&2
  fi
}

check_rust() {
  local wanted found
  wanted=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
  if ! have cargo || ! have rustc; then
    die "Rust $wanted or newer is needed and cargo or rustc is not on PATH" \
      "install it with rustup: https://rustup.rs"
  fi
  found=$(rustc --version | awk '{print $2}')
  if [ "$(printf '%s\n' "$wanted" "${found%%-*}" | sort -V | head -n 1)" != "$wanted" ]; then
    die "Rust $wanted or newer is needed, $(command -v rustc) is $found" \
      "a distribution's own Rust is often too old; install one with rustup: https://rustup.rs"
  fi
}

# -- virtual environment ---------------------------------------------------------------------------

make_venv() {
  local python
  # An environment whose interpreter was replaced has dead links, and is made anew.
  if [ -x "$VENV_PYTHON" ] && "$VENV_PYTHON" -m pip --version >/dev/null 2>&1; then
    return
  fi
  python=$(find_python)
  [ -n "$python" ] || die "Python 3.11 or newer is needed" "name one with PYTHON=/path/to/python3"
  say "virtual environment .venv with $("$python" --version)"
  rm -rf "$VENV"
  if can_make_venv "$python"; then
    "$python" -m venv "$VENV"
  else
    "$python" -m virtualenv --quiet "$VENV"
  fi
  # The first pip that knows dependency groups; Debian 12 brings 23.0.
  "$VENV_PYTHON" -m pip install 'pip>=25.1'
}

# install_group GROUP: installs a dependency group of pyproject.toml if that file has changed.
install_group() {
  local group=$1 key
  key=$(sha256sum <pyproject.toml)
  if [ "$key" != "$(cat "$STAMPS/$group" 2>/dev/null)" ]; then
    step "Python packages: $group" "$VENV_PYTHON" -m pip install --group "$group"
    printf '%s\n' "$key" >"$STAMPS/$group"
  fi
}

# -- module ----------------------------------------------------------------------------------------

# The Python sources need no build, because the installation is editable and points at python/.
module_inputs() {
  find Cargo.toml Cargo.lock pyproject.toml shaders crates -type f -printf '%p %s %T@\n' | sort
  rustc --version
  "$VENV_PYTHON" --version
}

build_module() {
  local key
  key=$(module_inputs | sha256sum)
  if [ "$key" = "$(cat "$STAMPS/module" 2>/dev/null)" ] &&
    "$VENV_PYTHON" -c 'import hizvk._core' 2>/dev/null; then
    return
  fi
  # With the profile of the tests, in which dependencies are optimised, wgpu is compiled once for
  # `cargo test` and for Python.
  step "building the Python module (the first time takes some minutes)" \
    env VIRTUAL_ENV="$VENV" PATH="$VENV/bin:$PATH" \
    maturin develop --extras viz,scene --features testing,yardstick "${LOCKED[@]}"
  # The key is the one from before the build, so what was edited meanwhile is built next time.
  printf '%s\n' "$key" >"$STAMPS/module"
}

check_rust
system_packages
make_venv
mkdir -p "$STAMPS"
window_packages
browser_package
for group in dev "$@"; do
  install_group "$group"
done
build_module
