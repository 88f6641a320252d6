#!/bin/sh
# Builds the images: build.sh OUT_DIR [VARIANT...] makes f405-VARIANT, the application, and f405-VARIANT-boot, its boot
# loader (.elf, .bin, .map). Variants: dac, pwm; with other encoders dac-index, pwm-index, dac-abs, pwm-abs. With -forget
# behind it, the application ends the pairing of a drive whose key is lost, at its start; the boot loader is the one without.
# Default: all, and dac-forget.
# Exit 3 where there is no ARM compiler.
# FLEXSPLINE_PUBLIC_KEY: the key of images, 64 digits of `flexspline key --show` (default: the public development key).
# EFFECTS: the effects that the application runs, separated by commas (default: all that run on a drive).
# FLEXSPLINE_DFU_UPLOAD=1: a host may read the firmware.
set -eu
out=${1:?usage: build.sh OUT_DIR [VARIANT...]}
shift
[ $# -gt 0 ] || set -- dac pwm dac-index pwm-index dac-abs pwm-abs dac-forget
here=$(cd -- "$(dirname -- "$0")" && pwd)
compiler=${ARM_GXX:-arm-none-eabi-g++}
for variant in "$@"; do
  FLAGS=
  case ${variant%-forget} in
    dac | pwm) ;;
    *-index) FLAGS=-DFLEXSPLINE_INDEXED ;;
    *-abs) FLAGS=-DFLEXSPLINE_ABSOLUTE ;;
    *) echo "build.sh: no variant $variant" >&2; exit 2 ;;
  esac
  case $variant in pwm*) FLAGS="$FLAGS -DFLEXSPLINE_PWM" ;; esac
  [ -z "${FLEXSPLINE_PUBLIC_KEY:-}" ] || FLAGS="$FLAGS -DFLEXSPLINE_PUBLIC_KEY=\"$FLEXSPLINE_PUBLIC_KEY\""
  [ -z "${FLEXSPLINE_DFU_UPLOAD:-}" ] || FLAGS="$FLAGS -DFLEXSPLINE_DFU_UPLOAD"
  case $variant in *-forget) FLAGS="$FLAGS -DFLEXSPLINE_FORGET_PAIRING" ;; esac
  export FLAGS
  "$here/../stm32f4/build_application.sh" stm32f405 "$out" f405-$variant
  case $variant in *-forget) continue ;; esac
  "$here/../cortex_m4/build.sh" "$out" f405-$variant-boot "$here/boot_loader.ld" "$here/../stm32f4/vectors.cpp" \
    "$here/boot_loader.cpp"
  "${compiler%g++}size" -A "$out/f405-$variant-boot.elf" | awk -v name="f405-$variant-boot" '
    $1 == ".text" || $1 == ".data" { flash += $2 }
    END { printf "%-28s flash %5d of 16384 bytes\n", name, flash }'
done
