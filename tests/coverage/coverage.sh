#!/usr/bin/env bash
# coverage.sh BUILD PAGE VERSION JOBS: runs the unit tests, the command tests and the report's of a build with gcc's counters, and
# writes PAGE, which lines of which folder ran, and BUILD/coverage/files.md, which files and functions did not. Files of counters
# from before are removed first. Exit code 1 if a test failed; the page is written nevertheless and says so.
set -euo pipefail
build=$1 page=$2 version=$3 jobs=$4
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$(cd -- "$here/../.." && pwd)
logs=$build/coverage
mkdir -p "$logs"
rm -f "$logs"/*.txt
find "$build" -name '*.gcda' -delete

# Each program in as many parts as there are jobs; the counters of processes add up. What is installed is more than is built here.
failed=()
export GTEST_FILTER=-Install.*
for program in flexspline_unit_tests flexspline_cli_tests flexspline_report_tests; do
  [[ -x $build/tests/$program ]] || continue
  echo "running $program" >&2
  running=()
  for ((part = 0; part < jobs; ++part)); do
    GTEST_TOTAL_SHARDS=$jobs GTEST_SHARD_INDEX=$part "$build/tests/$program" >"$logs/$program-$part.txt" 2>&1 </dev/null &
    running+=($!)
  done
  for one in "${running[@]}"; do wait "$one" || failed+=("$program"); done
done

# What was compiled, and never ran, has counters too: its notes are read without data. gcc's header of a template in several
# files is one; a branch that no test takes because it is an exception's is none of ours.
gcovr --root "$root" --object-directory "$build" --exclude-throw-branches \
  --filter "$root/(shared|firmware|hil|host)/" --json "$logs/coverage.json" -j "$jobs" "$build" >"$logs/gcovr.txt" 2>&1 || {
  tail -n 20 "$logs/gcovr.txt" >&2
  exit 2
}
python3 "$here/page.py" "$logs/coverage.json" "$here/reasons.txt" "$version" "$(grep -hE '^\[  PASSED  \]' "$logs"/*_tests-*.txt |
  awk '{n += $4} END {print n + 0}')" "${#failed[@]}" "$logs/files.md" >"$page"
grep '^- ' "$page"
echo "the page: $page; files and functions: $logs/files.md"
((${#failed[@]} == 0)) || {
  echo "tests failed: see $logs" >&2
  exit 1
}
