#!/bin/sh
# encoder_counts.sh DEFAULT: the compiler's flag for COUNTS, the counts a turn of the motor's encoder, or for DEFAULT
# where it is not set. Exit 2 where it is no number that a drive can count.
set -eu
counts=${COUNTS:-$1}
case $counts in
*[!0-9]* | 0* | ?????????*) valid=0 ;;
*) valid=$((counts >= 4 && counts <= 16777216)) ;;
esac
if [ "$valid" = 0 ]; then
  echo "COUNTS=$counts: the counts a turn of the motor's encoder are a whole number from 4 to 16777216, four for each line" >&2
  exit 2
fi
echo "-DFLEXSPLINE_ENCODER_COUNTS=$counts"
