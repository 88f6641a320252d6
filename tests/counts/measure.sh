#!/usr/bin/env bash
# measure.sh FOLDER ADVERSARIAL TICK_INPUTS IMAGE: builds the counting images into FOLDER, runs them and the application's
# IMAGE in QEMU, writes FOLDER/table.txt and compares it with budget.txt, above and below. ADVERSARIAL is the program of
# tests/same_bits, which writes the block; TICK_INPUTS that of tick_inputs.cpp.
# measure.sh instructions FOLDER ...: the same without estimated cycles and without the peers in floating point.
# measure.sh bits FOLDER ADVERSARIAL: the hashes of bare machines against those recorded.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)

# An image takes up to half a minute, so that of an earlier run is kept where nothing that it is made of has changed.
build() { # MACHINE SOURCE ELF FLAGS...
  local key
  key=$("$here/build.sh" key "$@")
  if [[ -f $3 && $(cat "$3.key" 2>/dev/null) == "$key" ]]; then return; fi
  rm -f "$3.key"
  # Newlib warns of what semihosting programs never call.
  "$here/build.sh" "$@" >"$3.log" 2>&1 || {
    cat "$3.log" >&2
    exit 1
  }
  echo "$key" >"$3.key"
}

if [[ $1 == bits ]]; then
  folder=$2 status=0
  mkdir -p "$folder"
  "$3" block >"$folder/block.inc"
  for machine in m0 m3 m4 m7 riscv; do
    build $machine "$here/same_bits.cpp" "$folder/bits-$machine.elf" -I"$folder"
    "$here/build.sh" run $machine "$folder/bits-$machine.elf" >"$folder/bits-$machine.txt"
    if diff "$folder/bits-$machine.txt" "$here/../same_bits/recorded_few.txt" >&2; then
      echo "$machine: the recorded bits, $(tail -n 1 "$folder/bits-$machine.txt")"
    else
      echo "$machine: other bits than those recorded; where that was meant: ./dev bits record" >&2
      status=1
    fi
  done
  exit $status
fi

peers=yes
if [[ $1 == instructions ]]; then
  peers=no
  shift
fi
folder=$1 image=$(realpath "$4")
mkdir -p "$folder"
"$2" block >"$folder/block.inc"
table=$folder/table.txt
: >"$table"

# What of the image is flash of `SYMBOL` and of the tables.
flash() { # ELF SYMBOL
  arm-none-eabi-nm -S -C "$1" | awk -v symbol="$2" '
    function hex(text, i, value) {
      for (i = 1; i <= length(text); ++i) value = 16 * value + index("0123456789abcdef", substr(text, i, 1)) - 1
      return value
    }
    NF >= 4 && (index($0, "::" symbol "(") || $0 ~ /detail::k(PowerOfTwo|Sine|LogMean|HalvingMean|WordLogTable)$/ ||
      $0 ~ /detail::(signed_product|sum_with_high|unsigned_product)\(/) { sum += hex($2) }
    END { print sum }'
}
# The deepest stack below a function, from the call graph: frames of all that can be called, one below the other.
stack() { # CALL_GRAPH FUNCTION
  awk -v name="$2" '
    /^node:/ {
      match($0, /title: "[^"]*"/); title = substr($0, RSTART + 8, RLENGTH - 9)
      if (match($0, /[0-9]+ bytes/)) own[title] = substr($0, RSTART, RLENGTH) + 0
      if (index($0, name "(")) start = title
    }
    /^edge:/ {
      match($0, /sourcename: "[^"]*"/); from = substr($0, RSTART + 13, RLENGTH - 14)
      match($0, /targetname: "[^"]*"/); to = substr($0, RSTART + 13, RLENGTH - 14)
      calls[from] = calls[from] "\n" to
    }
    function deepest(at, list, n, i, most, below) {
      if (at == "__indirect_call" || ++level > 50) return 1e6
      n = split(calls[at], list, "\n")
      for (i = 2; i <= n; ++i) { below = deepest(list[i]); if (below > most) most = below }
      --level
      return own[at] + most
    }
    END { print start == "" ? "-" : deepest(start) }' "$1"
}

# No helper of floating point may be in the image.
integers_only() { # ELF
  if arm-none-eabi-nm "$1" |
    grep -E '__aeabi_(f|d|cf|cd)(add|sub|mul|div|cmp|rsub|2)|__aeabi_(i|ui|l|ul)2[fd]|__(add|sub|mul|div)[sd]f3' >&2; then
    echo "$1 holds floating point" >&2
    exit 1
  fi
}

for machine in m4 m3 m0; do
  elf=$folder/counts-$machine.elf
  build count-$machine "$here/instructions.cpp" "$elf" -I"$folder" -fstack-usage -fcallgraph-info=su,da \
    -Wl,-Map="$folder/counts-$machine.map"
  arm-none-eabi-objcopy -O binary "$elf" "$folder/counts-$machine.bin"
  integers_only "$elf"
  "$here/build.sh" run count-$machine "$elf" | sed "s/^/$machine /" >>"$table"
  graph=$(ls "$folder"/counts-$machine*instructions.ci)
  for part in six_effects whole; do
    bytes=$(flash "$elf" ${part}_tick)
    echo "$machine ${part}_flash $bytes $bytes" >>"$table"
    bytes=$(stack "$graph" ${part}_tick)
    echo "$machine ${part}_stack $bytes $bytes" >>"$table"
  done
done
# The current loop of a three-phase motor, likewise.
build count-m4 "$here/current_loop.cpp" "$folder/current_loop.elf"
integers_only "$folder/current_loop.elf"
"$here/build.sh" run count-m4 "$folder/current_loop.elf" | sed 's/^/m4 /' >>"$table"
if [[ $peers == yes ]]; then
  # In the same run, on the same machine, compared with the same in floating point.
  build count-m4 "$here/instructions.cpp" "$folder/peers.elf" -I"$folder" -DFLEXSPLINE_PEERS -lm
  "$here/build.sh" run count-m4 "$folder/peers.elf" | grep '^six' | sed 's/^/m4-fpu /' >>"$table"
  build count-m4 "$here/current_loop.cpp" "$folder/current_loop_peer.elf" -DFLEXSPLINE_PEERS -lm
  "$here/build.sh" run count-m4 "$folder/current_loop_peer.elf" | sed 's/^/m4-fpu /' >>"$table"
  # Cycles, estimated from published timings, of all of these on three processors.
  for machine in m4 m3 m0; do
    elf=$folder/cycles-$machine.elf
    build count-$machine "$here/instructions.cpp" "$elf" -I"$folder" -DFLEXSPLINE_PEERS -DFLEXSPLINE_CYCLES -lm
    python3 "$here/cycles.py" $machine "$elf" six_effects=six_effects_tick encoder_filter=filter_tick loops=loops_tick \
      whole_tick=whole_tick "six_in_careful_float=Careful>::tick" "six_in_float_with_libm=Library<float> >::tick" \
      "six_in_double=Library<double> >::tick" | sed "s/^/$machine-cycles /" >>"$table"
  done
fi

# The application's own control tick: all of them by the image's counter, and by part two hundred that were followed: ten
# set points of the host, and 25 times every slow task.
"$3" record "$folder"
for drive in demo demo_and_seven; do
  rm -f "$folder/$drive/from_drive"
  (cd "$folder/$drive" && timeout 120 qemu-system-arm -M netduinoplus2 -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native -icount shift=0,sleep=off -kernel "$image" </dev/null >log 2>&1)
  echo "tick $drive $("$3" counts "$folder/$drive/from_drive")" >>"$table"
  python3 "$here/tick_parts.py" "$image" "$folder/$drive" 200 | sed "s/^/tick $drive./" >>"$table"
done

printf '%-9s %-32s %8s %8s %8s   %s\n' machine part least most mean budget
awk -v peers=$peers '
  function judged(key, value,    note) {
    if (!(key in high)) return ""
    seen[key] = 1
    note = low[key] " to " high[key]
    if (value > high[key]) { note = note "  ABOVE"; bad = 1 }
    if (value < low[key]) { note = note "  BELOW: lower the budget"; bad = 1 }
    return note
  }
  NR == FNR && peers == "no" && $1 ~ /-cycles$/ { next }
  NR == FNR { if ($0 !~ /^#/ && NF >= 4) { low[$1 " " $2] = $3; high[$1 " " $2] = $4 } next }
  {
    key = $1 " " $2; note = judged(key, $4); most[key] = $4; mean[key] = $5
    if (("mean-" key) in high) note = note ", mean " judged("mean-" key, $5)
    if ($1 == "tick" && split($2, name, ".") == 2) {
      if (name[2] == "whole") whole["tick " name[1]] = $5
      else parts["tick " name[1]] += $5
    }
    printf "%-9s %-32s %8s %8s %8s   %s\n", $1, $2, $3, $4, $5, note
  }
  END {
    for (key in high) if (!(key in seen)) { print "no " key " was measured"; bad = 1 }
    # A tick has to be as long as another: the longest leaves no room that the mean would.
    for (i = split("demo demo_and_seven", drives); i > 0; --i) {
      key = "tick " drives[i]
      if (most[key] > 1.15 * mean[key]) { print key ": the longest is more than 15 % above the mean"; bad = 1 }
      # Each part is rounded; to read the counter takes some instructions of its own.
      counter = mean[key] - whole[key]
      printf "%s: parts %d, all that were followed %d, by the counter %d\n", key, parts[key], whole[key], mean[key]
      off = parts[key] - whole[key]
      if (off > 5 || off < -5 || counter < 0 || counter > 40) { print key ": the parts are not the whole"; bad = 1 }
    }
    if (peers == "no") exit bad
    # Beside careful single precision: not above it where there is a unit for it, five times faster elsewhere.
    six = "-cycles six_effects"; peer = "-cycles six_in_careful_float"
    if (most["m4" six] > most["m4" peer]) { print "m4: six effects take more cycles than in floating point"; bad = 1 }
    split("m3 m0", without)
    for (i in without) {
      ratio = mean[without[i] peer] / mean[without[i] six]
      if (ratio < 5) { print without[i] ": six effects are only " ratio " times faster than in floating point"; bad = 1 }
    }
    exit bad
  }' "$here/budget.txt" "$table"
