#!/usr/bin/env bash
# run.sh PROGRAM SEEDS FOLDER SECONDS [RANDOM_SEED]: fuzzes for so long; without RANDOM_SEED with other inputs each time.
# New inputs go to FOLDER, so that the next run continues from there; one that fails is left next to them, and its path is
# printed. Fails also where so few ran that it says nothing.
set -euo pipefail
program=$1 seeds=$2 folder=$3 seconds=$4 random_seed=${5:-0}
mkdir -p "$folder/corpus"
# As long as the longest seed, so that none is cut.
longest=$(find "$seeds" -type f -printf '%s\n' | sort -n | tail -n 1)
status=0
"$program" "$folder/corpus" "$seeds" -max_total_time="$seconds" -max_len="$((longest > 1024 ? longest : 1024))" -timeout=10 -rss_limit_mb=1500 \
  -seed="$random_seed" -artifact_prefix="$folder/" -print_final_stats=1 >"$folder/log.txt" 2>&1 || status=$?
if ((status != 0)); then
  tail -n 60 "$folder/log.txt" >&2
  exit 1
fi
awk -v fewest="$((2 * seconds))" '
  /cov: / { for (i = 1; i < NF; ++i) if ($i == "cov:") covered = $(i + 1) }
  /stat::number_of_executed_units/ { units = $2 }
  END { printf "%d inputs, %d edges covered, nothing found\n", units, covered; exit units < fewest }' "$folder/log.txt"
