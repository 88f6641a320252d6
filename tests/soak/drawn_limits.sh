#!/usr/bin/env bash
# Blocks with drawn limits under the sanitizers (tests/campaign/drawn_limits_test.cpp), ten thousand seeds after the other until
# the time is over or all are done. Continues where the last run of this program stopped.
#
#   drawn_limits.sh PROGRAM MINUTES FOLDER      FOLDER: the output of each part, and which were run
#
# Exit code: 1 if one failed.
set -euo pipefail
program=${1:?} minutes=${2:?} folder=${3:?}
all=180000 part=10000
# shellcheck source-path=SCRIPTDIR source=resumable.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/resumable.sh"
begin_campaign "$minutes" "$folder" "$program"
for ((first = 0; first < all; first += part)); do
  if grep -q "^$first " "$folder/done.txt"; then continue; fi
  ((SECONDS < until)) || break
  began=$SECONDS result=failed
  if FLEXSPLINE_FIRST_SEED=$first FLEXSPLINE_SEEDS=$part "$program" >"$folder/$first.txt" 2>&1; then result=passed; fi
  taken=$(awk '/drawn blocks were taken/ {print $1}' "$folder/$first.txt")
  echo "$first $result ${taken:-0} $((SECONDS - began))" >>"$folder/done.txt"
done
awk -v part=$part -v folder="$folder" '{taken += $3; time += $4; if ($2 != "passed") failed = failed "  " folder "/" $1 ".txt\n"}
  END {printf "%d drawn blocks, %d taken by the validator, %d s under the sanitizers: %s", NR * part, taken, time,
       failed == "" ? "every protection acted, nothing found\n" : "failed:\n" failed
       exit failed != ""}' "$folder/done.txt"
