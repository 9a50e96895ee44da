# shellcheck shell=bash disable=SC2034  # the variables are for the scripts that source this
# Sourced by every script here: paths, messages, steps, and the choice of the Vulkan driver.

ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$ROOT" || exit

VENV="$ROOT/.venv"
VENV_PYTHON="$VENV/bin/python"
# One file for each part that setup has done; it holds the key of the part's inputs.
STAMPS="$VENV/.hizvk"

# rustup installs here; a non-interactive shell may not have it on PATH.
[ -d "${CARGO_HOME:-$HOME/.cargo}/bin" ] && PATH="$PATH:${CARGO_HOME:-$HOME/.cargo}/bin"
export PATH
# On a developer's machine a changed Cargo.toml may change Cargo.lock.
# In CI nobody would commit that, so it is an error there.
LOCKED=(${CI:+--locked})
# For Rust's tests: without this, Mesa's device-select layer complains about XDG_RUNTIME_DIR.
# The Python module sets it for itself.
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

# step NAME COMMAND...: runs the command and says how long it took.
# set -e has no effect inside it, so a step is one command, or checks its own commands.
step() {
  local name=$1 start=$SECONDS status=0
  shift
  say "$name"
  "$@" || status=$?
  printf -- '-- %s: %d s%s\n' "$name" $((SECONDS - start)) \
    "$([ $status = 0 ] || printf ', failed')"
  return $status
}

# check NAME COMMAND...: a step; if it fails, the others still run, and `checked` fails at the end.
FAILED=()
check() { step "$@" || FAILED+=("$1"); }
checked() { [ ${#FAILED[@]} -eq 0 ] || die "failed: $(printf '%s; ' "${FAILED[@]}")"; }

# Prints the manifest of lavapipe, Mesa's software driver, or nothing if it is not installed.
lavapipe_icd() {
  local dir file
  for dir in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
    for file in "$dir"/lvp_icd*.json; do
      [ -e "$file" ] && printf '%s\n' "$file" && return
    done
  done
  return 0
}

# use_driver MANIFEST: hides all other Vulkan drivers from here on.
# Loaders before 1.3.207 know only the second name.
use_driver() {
  export VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1
}

# Chooses the tests' driver: lavapipe, unless the caller expects another adapter, such as a GPU.
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
