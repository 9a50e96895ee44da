# shellcheck shell=bash disable=SC2034  # the variables are for the scripts that source this
# Sourced by every script here: where things are, how things are said, and which Vulkan driver is used.

ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$ROOT" || exit

VENV="$ROOT/.venv"
VENV_PYTHON="$VENV/bin/python"
# What setup has done, one file a part: its content is the key of the inputs.
STAMPS="$VENV/.hizvk"

# rustup installs here; a non-interactive shell may not have it on PATH.
[ -d "${CARGO_HOME:-$HOME/.cargo}/bin" ] && PATH="$PATH:${CARGO_HOME:-$HOME/.cargo}/bin"
export PATH
# On a developer's machine a changed Cargo.toml may change Cargo.lock; where nobody commits it, that is an error.
LOCKED=(${CI:+--locked})
# For Rust's tests: Mesa's device-select layer complains about XDG_RUNTIME_DIR otherwise. (Python asks for its absence itself.)
export NODEVICE_SELECT=1
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_QUIET=1

have() { command -v "$1" >/dev/null 2>&1; }
say() { printf '\n== %s\n' "$*"; }
die() {
  printf 'error: %s\n' "$1" >&2
  shift
  [ $# -eq 0 ] || printf '       %s\n' "$@" >&2
  exit 1
}

# step NAME COMMAND...: runs it and says how long it took. (set -e is off inside of it: a step is one command, or checks its own.)
step() {
  local name=$1 start=$SECONDS status=0
  shift
  say "$name"
  "$@" || status=$?
  printf -- '-- %s: %d s%s\n' "$name" $((SECONDS - start)) "$([ $status = 0 ] || printf ', failed')"
  return $status
}

# check NAME COMMAND...: a step after whose failure the others still run; `checked` at the end fails then.
FAILED=()
check() { step "$@" || FAILED+=("$1"); }
checked() { [ ${#FAILED[@]} -eq 0 ] || die "failed: $(printf '%s; ' "${FAILED[@]}")"; }

# The manifest of lavapipe, Mesa's software driver; empty if it is not installed.
lavapipe_icd() {
  local dir file
  for dir in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
    for file in "$dir"/lvp_icd*.json; do
      [ -e "$file" ] && printf '%s\n' "$file" && return
    done
  done
  return 0
}

# use_driver MANIFEST: no other Vulkan driver is seen from here on. Loaders before 1.3.207 know the second name only.
use_driver() {
  export VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1
}

# The tests' driver: lavapipe, unless the caller names another adapter to expect (their own GPU, say).
use_test_driver() {
  if [ -n "${HIZVK_EXPECT_ADAPTER:-}" ]; then
    return
  fi
  local icd
  icd=$(lavapipe_icd)
  [ -n "$icd" ] || die "lavapipe, Mesa's software Vulkan driver, is not installed" "run: make setup"
  use_driver "$icd"
  export HIZVK_EXPECT_ADAPTER=llvmpipe
}
