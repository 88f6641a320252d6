#!/usr/bin/env bash
# soak.sh PROGRAMS MINUTES FOLDER: every fuzz target in turn, each for its share of the time, going on from the corpora in
# FOLDER/NAME. Inputs that failed before come first. Exit code 1 if anything was found; all targets run nevertheless.
set -euo pipefail
programs=$1 minutes=$2 folder=$3
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
targets=()
for source in "$here"/*_fuzz.cpp; do targets+=("$(basename "$source" _fuzz.cpp)"); done
seconds=$(awk -v m="$minutes" -v n="${#targets[@]}" 'BEGIN { s = int(60 * m / n); print s < 2 ? 2 : s }')
summary=() found=0
for target in "${targets[@]}"; do
  program=$programs/${target}_fuzz own=$folder/$target
  [[ -x $program ]] || {
    echo "soak.sh: $program is not there; it is built by ./dev soak MINUTES fuzz" >&2
    exit 2
  }
  mkdir -p "$own/corpus"
  still=()
  for input in "$own"/{crash,leak,timeout,oom,slow-unit}-*; do
    [[ -f $input ]] || continue
    "$program" -timeout=10 -rss_limit_mb=1500 "$input" >"$own/again.txt" 2>&1 || still+=("$input")
  done
  before=$(find "$own/corpus" -type f | wc -l)
  echo "$target: $seconds s from $before inputs" >&2
  status=0
  said=$("$here/run.sh" "$program" "$here/corpus/$target" "$own" "$seconds" 2>"$own/finding.txt") || status=$?
  if ((status != 0)); then
    tail -n 40 "$own/finding.txt" >&2
    said="FAILED: $(grep -h -m 1 -oE '(ERROR: [^(]*|runtime error: .*|[a-z_]+_fuzz: .*)' "$own/log.txt" || echo "see $own/log.txt")"
    said+="; input: $(grep -h -m 1 -oE 'Test unit written to .*' "$own/log.txt" | sed 's/Test unit written to //' || echo none)"
    found=1
  fi
  for input in "${still[@]}"; do
    said+=$'\n'"    still fails: $input"
    found=1
  done
  summary+=("  $target: $said; corpus $before to $(find "$own/corpus" -type f | wc -l)")
done
printf '%s\n' "${summary[@]}"
if ((found)); then echo "something was found; correct it, and put its input into tests/fuzz/corpus"; fi
exit "$found"
