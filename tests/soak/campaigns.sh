#!/usr/bin/env bash
# The campaigns of the tests at full size, one test after the other until the time is over; a test that was started is finished.
# Continues where the last run of this program stopped.
#
#   campaigns.sh MINUTES FOLDER PROGRAM[:SUITE,...]...
#                  FOLDER: each test's output, and which tests were run; of a program all suites, or those that are named
#
# Exit code: 1 if one failed.
set -euo pipefail
minutes=${1:?} folder=${2:?}
programs=("${@:3}")
# shellcheck source-path=SCRIPTDIR source=resumable.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/resumable.sh"
begin_campaign "$minutes" "$folder" "${programs[@]%%:*}"
tests=()
for one in "${programs[@]}"; do
  suites=''
  [[ $one != *:* ]] || suites=${one#*:}
  mapfile -t -O "${#tests[@]}" tests < <(FLEXSPLINE_WHOLE_CAMPAIGNS=1 "${one%%:*}" --gtest_list_tests |
    awk -v suites=",$suites," -v program="${one%%:*}" '
      /^[^ ]/ {suite = $1}
      /^ / && (suites == ",," || index(suites, "," substr(suite, 1, length(suite) - 1) ",")) {print program "\t" suite $1}')
done
for program_and_test in "${tests[@]}"; do
  IFS=$'\t' read -r program test <<<"$program_and_test"
  if grep -q "^$test " "$folder/done.txt"; then continue; fi
  ((SECONDS < until)) || break
  began=$SECONDS result=failed said=$folder/${test//\//-}.txt
  if FLEXSPLINE_WHOLE_CAMPAIGNS=1 "$program" --gtest_filter="$test" >"$said" 2>&1; then result=passed; fi
  if grep -q '^\[  SKIPPED \]' "$said"; then result=skipped; fi
  echo "$test $result $((SECONDS - began)) s" | tee -a "$folder/done.txt"
done
awk -v all="${#tests[@]}" -v folder="$folder" '{
    ++n[$2]; file = $1; gsub("/", "-", file)
    if ($2 == "failed") failed = failed "  " $1 ": " folder "/" file ".txt\n"
  }
  END {printf "%d of %d campaigns run: %d passed, %d failed, %d skipped\n%s", NR, all, n["passed"], n["failed"], n["skipped"], failed
       exit n["failed"] > 0}' "$folder/done.txt"
