#!/usr/bin/env bash
# bench.sh BUILD OUT: every bench of BUILD and its peers, then one table of ratios with their goals, also in OUT/table.md.
# What is compared is in README.md. Exit code 1 where a peer gave another answer or could not be run; a goal that is missed
# is said and is no failure, as times are no law.
set -euo pipefail
build=$1 out=$2 status=0
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
# Debian's own Python: another one on the path need not have SciPy.
python=/usr/bin/python3
mkdir -p "$out"
export FLEXSPLINE_BENCH_ROWS=$out/rows.txt
: >"$FLEXSPLINE_BENCH_ROWS"

"$build/tests/flexspline_identify_bench" $python octave-cli "$here" || status=1
"$build/tests/flexspline_diagnosis_bench" $python "$here/scipy_diagnosis.py" || status=1
"$build/tests/flexspline_simulation_bench" $python "$here/scipy_simulation.py" || status=1
"$build/tests/flexspline_round_trips_bench" "$build/flexspline-hil" "$build/tests/flexspline_echo_bench" || status=1

# Instructions, which are counted: the same in every run.
if "$here/../counts/measure.sh" "$out/counts" "$build/tests/counts/flexspline_adversarial" "$build/tests/counts/flexspline_tick_inputs" \
  "$build/boards/qemu_stm32f405/image.elf" >"$out/counts.txt" 2>&1; then
  awk '
    { most[$1 " " $2] = $4; mean[$1 " " $2] = $5 }
    END {
      split("six_in_careful_float six_in_float_with_libm six_in_double", peers)
      split("careful single precision|single precision with the C library|double precision", names, "|")
      for (i = 1; i <= 3; ++i)
        printf "instructions a tick of six effects, Cortex-M4 | %s | - | %.3g\n", names[i], most["m4-fpu " peers[i]] / most["m4 six_effects"]
      split("m4 m3 m0", processors); split("M4|M3|M0", called, "|"); split("at least 1|at least 5|at least 5", goals, "|")
      for (p = 1; p <= 3; ++p)
        printf "cycles a tick of six effects, estimated, Cortex-%s | careful single precision | %s | %.3g\n", called[p], goals[p],
          mean[processors[p] "-cycles six_in_careful_float"] / mean[processors[p] "-cycles six_effects"]
    }' "$out/counts/table.txt" >>"$FLEXSPLINE_BENCH_ROWS"
else
  tail -n 5 "$out/counts.txt" >&2
  status=1
fi

# The twin runs the drive's own code with its plant.
"$python" "$here/twin.py" "$build" >>"$FLEXSPLINE_BENCH_ROWS" || status=1

awk -F ' [|] ' '
  BEGIN { print "| what | compared with | goal | measured | |"; print "| --- | --- | --- | ---: | --- |" }
  {
    verdict = ""
    split($3, goal, " ")
    if (goal[2] == "least") verdict = $4 + 0 >= goal[3] + 0 ? "met" : "missed"
    if (goal[2] == "most") verdict = $4 + 0 <= goal[3] + 0 ? "met" : "missed"
    printf "| %s | %s | %s | %s | %s |\n", $1, $2, $3, $4, verdict
  }' "$FLEXSPLINE_BENCH_ROWS" | tee "$out/table.md"
exit $status
