#!/bin/sh
# build_application.sh BOARD OUT_DIR NAME: the application of boards/BOARD as OUT_DIR/NAME.elf, .bin and .map; flags of a
# variant in FLAGS, a set of effects in EFFECTS. Prints flash and RAM. Exit 3 where there is no ARM compiler.
set -eu
boards=$(cd -- "$(dirname -- "$0")/.." && pwd)
board=$boards/$1 out=$2 name=$3
FOR=speed "$boards/cortex_m4/build.sh" "$out" "$name" "$board/application.ld" "$boards/stm32f4/vectors.cpp" "$board/main.cpp"
compiler=${ARM_GXX:-arm-none-eabi-g++}
limit=$((0x$("${compiler%g++}nm" "$out/$name.elf" | awk '$3 == "image_limit" { print $1 }')))
"${compiler%g++}size" -A "$out/$name.elf" | awk -v name="$name" -v limit=$limit -v effects="${EFFECTS:-}" '
  $1 == ".text" || $1 == ".data" { flash += $2 }
  $1 == ".data" || $1 == ".bss" || $1 == ".stack" { ram += $2 }
  END { printf "%-28s flash %5d of %d bytes, RAM %5d bytes, effects: %s\n", name, flash, limit, ram, effects == "" ? "all" : effects }'
