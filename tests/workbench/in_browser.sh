#!/usr/bin/env bash
# The workbench in headless Chromium: in_browser.sh story|figures TOOL WORK runs what its user does, or takes times. 77 where
# Chromium, Node.js or npm cannot be had.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
what=$1 tool=$(realpath -- "$2") work=$(realpath -m -- "$3")
skip() {
  echo "in_browser.sh: Skipped"
  echo "$*"
  echo "[  SKIPPED ]"
  exit 77
}
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) ||
  skip "there is no Chromium (Debian: chromium)"
command -v npm >/dev/null && command -v node >/dev/null || skip "there is no Node.js with npm (Debian: nodejs npm)"
mkdir -p "$work/npm"
cp "$here/package.json" "$work/npm/"
# Tests that run at once would install into one another's folder.
exec 8>"$work/npm.lock"
flock 8
if [[ ! -f $work/npm/node_modules/axe-core/axe.min.js || ! -d $work/npm/node_modules/playwright-core ]]; then
  (cd "$work/npm" && timeout 300 npm install --no-save --no-audit --no-fund --no-package-lock --ignore-scripts >npm.log 2>&1) ||
    skip "the packages of package.json cannot be had from npm: $(tail -n 1 "$work/npm/npm.log")"
fi
flock -u 8
# A long name without a space: the page shows the folder, and must not grow wider by it.
exec node "$here/$what.mjs" "$tool" "$work/npm" "$work/$what-in_a_folder_with_a_long_name_that_has_no_space" "$chromium"
