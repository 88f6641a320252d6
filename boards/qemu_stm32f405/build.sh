#!/bin/sh
# Builds the image: build.sh OUT_DIR; the effects of EFFECTS, separated by commas (default: all that run on a drive). Exit 3 where there is no ARM compiler.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
FOR=speed "$here/../cortex_m4/build.sh" "$out" image "$here/board.ld" "$here/vectors.cpp" "$here/semihosting.cpp" "$here/main.cpp"
# Flash, and RAM without the telemetry ring of 8 KB and the residual map of 3848 bytes but with the stack; the linker script holds both to their limits.
compiler=${ARM_GXX:-arm-none-eabi-g++}
"${compiler%g++}size" -A "$out/image.elf" | awk '
  $1 == ".text" || $1 == ".data" { flash += $2 }
  $1 == ".data" || $1 == ".bss" || $1 == ".stack" { ram += $2 }
  END { printf "flash %d of 98304 bytes, RAM %d of 8192 bytes without the telemetry ring and the residual map\n", flash, ram - 8192 - 3848 }'
