#!/bin/sh
# build.sh OUT_DIR NAME SCRIPT.ld SOURCE...: builds OUT_DIR/NAME.elf, .bin and .map for a Cortex-M4; flags in FLAGS.
# EFFECTS="coulomb_friction,torque_ripple": only these effects of shared/effects; default: all that run on a drive.
# FOR=speed for an application, whose tick has to be fast; otherwise it optimises for size, as for a boot loader. Exit 3 where there is no ARM compiler.
set -eu
here=$(cd -- "$(dirname -- "$0")" && pwd)
root=$(cd -- "$here/../.." && pwd)
out=$1 name=$2 script=$3
shift 3
compiler=${ARM_GXX:-arm-none-eabi-g++}
command -v "$compiler" >/dev/null || {
  echo "no $compiler: install gcc-arm-none-eabi, libnewlib-arm-none-eabi and libstdc++-arm-none-eabi-newlib" >&2
  exit 3
}
mkdir -p "$out"
[ -z "${EFFECTS:-}" ] || FLAGS="${FLAGS:-} -DFLEXSPLINE_EFFECTS=\"$EFFECTS\""
new=$out/$name.elf.new
# Link-time optimisation; without scheduling, which needs registers and gains little on these processors. Without copies of
# functions for constant arguments for size; for speed without partial redundancy elimination, conditional instructions and
# another order of blocks, all of which make the control tick longer.
if [ "${FOR:-size}" = speed ]; then
  optimise="-O3 -fno-tree-pre -fno-if-conversion2 -fno-reorder-blocks -frename-registers"
else
  optimise="-Os -fno-schedule-insns2 -fno-ipa-cp -fno-reorder-blocks -fno-tree-ch"
fi
# Debugging information is not programmed into flash; it shows to which part of a tick an instruction belongs.
# shellcheck disable=SC2086
"$compiler" -std=c++20 -g -ffile-prefix-map="$root"=. $optimise -flto=1 -fno-schedule-insns -mcpu=cortex-m4 -mthumb -mfloat-abi=soft \
  -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-unwind-tables \
  -fno-asynchronous-unwind-tables -Wall -Wextra -Wpedantic -Wshadow -Werror -Wno-volatile \
  -nostartfiles -Wl,--gc-sections -Wl,-Map="$out/$name.map" -T "$script" -L "$(dirname -- "$script")" -I "$root" \
  ${FLAGS:-} "$here/start.cpp" "$here/library.cpp" "$@" -o "$new" --specs=nano.specs --specs=nosys.specs
"$here/integers_only.sh" "${compiler%g++}nm" "$new"
"${compiler%g++}objcopy" -O binary "$new" "$out/$name.bin"
mv "$new" "$out/$name.elf"
