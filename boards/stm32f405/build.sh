#!/bin/sh
# Builds the images: build.sh OUT_DIR makes f405-dac and f405-pwm, the applications, and f405-dac-boot and f405-pwm-boot,
# their boot loaders (.elf, .bin, .map). Exit 3 where there is no ARM compiler.
# FLEXSPLINE_PUBLIC_KEY: the key of images, 64 digits of `flexspline key --show` (default: the public development key).
# FLEXSPLINE_DFU_UPLOAD=1: a host may read the firmware.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
compiler=${ARM_GXX:-arm-none-eabi-g++}
for variant in dac pwm; do
  FLAGS=
  [ $variant = dac ] || FLAGS=-DFLEXSPLINE_PWM
  [ -z "${FLEXSPLINE_PUBLIC_KEY:-}" ] || FLAGS="$FLAGS -DFLEXSPLINE_PUBLIC_KEY=\"$FLEXSPLINE_PUBLIC_KEY\""
  [ -z "${FLEXSPLINE_DFU_UPLOAD:-}" ] || FLAGS="$FLAGS -DFLEXSPLINE_DFU_UPLOAD"
  export FLAGS
  "$here/../stm32f4/build_application.sh" stm32f405 "$out" f405-$variant
  "$here/../cortex_m4/build.sh" "$out" f405-$variant-boot "$here/boot_loader.ld" "$here/../stm32f4/vectors.cpp" \
    "$here/boot_loader.cpp"
  "${compiler%g++}size" -A "$out/f405-$variant-boot.elf" | awk -v name="f405-$variant-boot" '
    $1 == ".text" || $1 == ".data" { flash += $2 }
    END { printf "%-28s flash %5d of 16384 bytes\n", name, flash }'
done
