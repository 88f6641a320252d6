#!/usr/bin/env bash
# The campaigns of the tests at full size, one test after the other until the time is over; a test that was started is finished.
# Continues where the last run of this program stopped.
#
#   campaigns.sh PROGRAM MINUTES FOLDER      FOLDER: each test's output, and which tests were run
#
# Exit code: 1 if one failed.
set -euo pipefail
program=${1:?} minutes=${2:?} folder=${3:?}
# shellcheck source-path=SCRIPTDIR source=resumable.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/resumable.sh"
begin_campaign "$program" "$minutes" "$folder"
mapfile -t tests < <("$program" --gtest_list_tests | awk '/^[^ ]/ {suite = $1} /^ / {print suite $1}')
for test in "${tests[@]}"; do
  if grep -q "^$test " "$folder/done.txt"; then continue; fi
  ((SECONDS < until)) || break
  began=$SECONDS result=failed
  if FLEXSPLINE_WHOLE_CAMPAIGNS=1 "$program" --gtest_filter="$test" >"$folder/$test.txt" 2>&1; then result=passed; fi
  if grep -q '^\[  SKIPPED \]' "$folder/$test.txt"; then result=skipped; fi
  echo "$test $result $((SECONDS - began)) s" | tee -a "$folder/done.txt"
done
awk -v all="${#tests[@]}" -v folder="$folder" '{++n[$2]; if ($2 == "failed") failed = failed "  " $1 ": " folder "/" $1 ".txt\n"}
  END {printf "%d of %d campaigns run: %d passed, %d failed, %d skipped\n%s", NR, all, n["passed"], n["failed"], n["skipped"], failed
       exit n["failed"] > 0}' "$folder/done.txt"
