#!/usr/bin/env bash
# bits.sh BUILD MINUTES FOLDER: for one seed after the other, drives in closed loop by two compilers, a minute of each case, and a
# million adversarial ticks of all effects over a thousand drawn blocks by each compiler at two levels of optimisation;
# all bits compared. FOLDER/seeds.txt names the seeds that were the same; the next run continues after them.
set -euo pipefail
build=$1 minutes=$2 folder=$3
seconds=60
mkdir -p "$folder"
touch "$folder/seeds.txt"
first=$build/tests/same_bits/closed_loop-g++ second=$build/tests/same_bits/closed_loop-clang++
end=$(($(date +%s) + $(awk -v m="$minutes" 'BEGIN { printf "%d", 60 * m }')))
seed=$(awk 'END { print NR > 0 ? $1 : 0 }' "$folder/seeds.txt")
while (($(date +%s) < end)); do
  seed=$((seed + 1))
  "$first" $seed $seconds >"$folder/one.txt" &
  "$second" $seed $seconds >"$folder/other.txt"
  wait $!
  if ! diff "$folder/one.txt" "$folder/other.txt" >"$folder/differs-$seed.txt"; then
    echo "bits: seed $seed differs between compilers; $folder/differs-$seed.txt begins with" >&2
    head -n 4 "$folder/differs-$seed.txt" >&2
    exit 1
  fi
  rm "$folder/differs-$seed.txt"
  for level in g++-O0 g++-O3 clang++-O0 clang++-O3; do
    "$build/tests/same_bits/adversarial-$level" drawn $seed 1000
  done >"$folder/drawn.txt"
  if (($(sort -u "$folder/drawn.txt" | wc -l) != 1)); then
    echo "bits: the drawn blocks of seed $seed differ between g++ -O0, -O3, clang++ -O0, -O3:" >&2
    cat "$folder/drawn.txt" >&2
    exit 1
  fi
  echo "$seed $(grep -c telemetry "$folder/one.txt")" >>"$folder/seeds.txt"
done
awk -v seconds=$seconds '
  { runs += $2 }
  END {
    printf "bits: %d seeds, %d runs, %.2f hours in closed loop: the same bits by g++ and clang++\n", NR, runs, runs * seconds / 3600
    printf "bits: %g adversarial ticks over %d drawn blocks: the same by both at -O0 and -O3\n", 1e6 * NR, 1000 * NR
  }
' "$folder/seeds.txt"
