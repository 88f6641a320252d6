#!/bin/sh
# Builds the images: build.sh OUT_DIR makes odrive, the application, and odrive-boot, its boot loader (.elf, .bin, .map).
# COUNTS=N: counts a turn of the motor's encoder, four for each of its lines (default: 8192). FLEXSPLINE_PUBLIC_KEY,
# EFFECTS: as stm32f405/build.sh. Exit 3 where there is no ARM compiler.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
compiler=${ARM_GXX:-arm-none-eabi-g++}
FLAGS=$("$here/../stm32f4/encoder_counts.sh" 8192)
[ -z "${FLEXSPLINE_PUBLIC_KEY:-}" ] || FLAGS="$FLAGS -DFLEXSPLINE_PUBLIC_KEY=\"$FLEXSPLINE_PUBLIC_KEY\""
export FLAGS
"$here/../stm32f4/build_application.sh" odrive_v36 "$out" odrive
"$here/../cortex_m4/build.sh" "$out" odrive-boot "$here/boot_loader.ld" "$here/../stm32f4/vectors.cpp" "$here/boot_loader.cpp"
"${compiler%g++}size" -A "$out/odrive-boot.elf" | awk '
  $1 == ".text" || $1 == ".data" { flash += $2 }
  END { printf "%-28s flash %5d of 16384 bytes\n", "odrive-boot", flash }'
