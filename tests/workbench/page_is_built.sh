#!/usr/bin/env bash
# The page that is embedded is what its sources build. page_is_built.sh PAGE WORK; 77 where npm cannot be had.
set -euo pipefail
page=$1 work=$2
skip() {
  echo "page_is_built.sh: Skipped"
  echo "$*"
  echo "[  SKIPPED ]"
  exit 77
}
command -v npm >/dev/null && command -v node >/dev/null || skip "there is no Node.js with npm (Debian: nodejs npm)"
mkdir -p "$work"
rm -rf "$work/src" "$work/built"
cp -r "$page/package.json" "$page/vite.config.ts" "$page/tsconfig.json" "$page/index.html" "$page/src" "$work/"
if [[ ! -d $work/node_modules/vite || ! -d $work/node_modules/uplot || ! -d $work/node_modules/typescript ]]; then
  (cd "$work" && timeout 300 npm install --no-save --no-audit --no-fund --no-package-lock >npm.log 2>&1) ||
    skip "the packages of package.json cannot be had from npm: $(tail -n 1 "$work/npm.log")"
fi
cd "$work"
npm run build >build.log 2>&1 || {
  cat build.log
  exit 1
}
diff -r built "$page/built" >/dev/null || {
  echo "host/app/workbench/page/built is not what its sources make; run: ./dev page"
  exit 1
}
