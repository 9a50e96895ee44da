# shellcheck shell=bash
# Sourced by setup.sh, after common.sh: a browser for the test of a result's HTML page.
# The test skips itself without one, so nothing ends here.

# Seconds that a browser may take to say its version; one that hangs is none.
BROWSER_GUARD_S=${BROWSER_GUARD_S:-20}

# runs_as_browser NAME: whether it is Chromium.
# On Ubuntu the command may be a stub that asks for a snap, which fails or waits.
runs_as_browser() {
  have "$1" && timeout "$BROWSER_GUARD_S" "$1" --version </dev/null 2>/dev/null | grep -q '[0-9]\.'
}

# Whether the package of that name only fetches a snap, as Ubuntu's does.
# A container has no snaps, and installing it would fail or wait for them.
is_snap_package() { apt-cache show "$1" 2>/dev/null | grep -qiw snap; }

browser_note() {
  printf 'note: the test of the HTML page is skipped without Chromium: %s\n' "$1" >&2
}

# About 120 MB are downloaded.
browser_package() {
  local name
  for name in chromium chromium-browser google-chrome; do
    ! runs_as_browser "$name" || return 0
  done
  # What could not be installed once is not tried again.
  [ ! -e "$STAMPS/browser" ] || return 0
  touch "$STAMPS/browser"
  if have apt-cache && is_snap_package chromium; then
    browser_note "here its package is a snap; install Google's own package, google-chrome"
  elif ! have apt-get || ! can_be_root || ! (apt_install chromium) ||
    ! runs_as_browser chromium; then
    browser_note \
      "sudo sh -c 'apt-get update && apt-get install -y --no-install-recommends chromium'"
  fi
}
