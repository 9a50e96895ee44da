#!/usr/bin/env bash
# All checks of style and types by machine; runs to the end and fails if any check failed.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts/setup.sh
export PATH="$VENV/bin:$PATH" MYPYPATH=python
python_files=(python tools tests scripts docs examples)

check "cargo fmt" cargo fmt --all -- --check -l
check "clippy" cargo clippy --workspace --all-targets "${LOCKED[@]}" -- -D warnings
# The features of a renderer and those of a user without tools: neither has testing or yardstick.
embedded=(--no-default-features --features vulkan)
check "clippy, a renderer's features" \
  cargo clippy -p hiz_core --lib "${embedded[@]}" "${LOCKED[@]}" -- -D warnings
check "clippy, default features" cargo clippy -p hiz_core --lib "${LOCKED[@]}" -- -D warnings
# A wheel's module has the feature `methods` without `testing`.
check "clippy, a wheel's features" cargo clippy -p hiz_py --lib "${LOCKED[@]}" -- -D warnings
# What waits for a device stays out of a renderer's build.
embedded_tree() {
  local tree
  tree=$(cargo tree -p hiz_core "${embedded[@]}" -e normal --prefix none "${LOCKED[@]}") || return
  ! grep '^pollster ' <<<"$tree"
}
check "a renderer's dependencies" embedded_tree
# Without this, links in documentation break silently.
rust_links() { RUSTDOCFLAGS="-D warnings" cargo doc --workspace "${LOCKED[@]}" --no-deps; }
check "rustdoc links" rust_links
check "ruff check" ruff check "${python_files[@]}"
check "ruff format" ruff format --check "${python_files[@]}"
check "mypy" mypy --strict python/hizvk tools examples
# The stubs are written by hand; this compares them with the built module.
check "stubtest" python -m mypy.stubtest hizvk --concise --mypy-config-file pyproject.toml
if have shellcheck; then
  check "shellcheck" shellcheck scripts/*.sh .ci/run
else
  printf 'shellcheck is not installed: the shell scripts were not checked\n'
fi
if have actionlint; then
  check "workflows" actionlint
else
  printf 'actionlint is not installed: the workflows were not checked\n'
fi

checked
