#!/bin/sh
# Builds the image: build.sh OUT_DIR. Exit 3 where there is no ARM compiler.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
root=$(cd -- "$here/../.." && pwd)
compiler=${ARM_GXX:-arm-none-eabi-g++}
command -v "$compiler" >/dev/null || {
  echo "no $compiler: install gcc-arm-none-eabi, libnewlib-arm-none-eabi and libstdc++-arm-none-eabi-newlib" >&2
  exit 3
}
mkdir -p "$out"
# As a whole; without scheduling, from which these processors gain little and which takes registers; without copies of
# functions for constant arguments: all of that saves flash.
"$compiler" -std=c++20 -Os -flto -fno-schedule-insns -fno-schedule-insns2 -fno-ipa-cp \
  -fno-reorder-blocks -fno-tree-ch -mcpu=cortex-m4 -mthumb -mfloat-abi=soft \
  -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-unwind-tables \
  -fno-asynchronous-unwind-tables -Wall -Wextra -Wpedantic -Wshadow -Werror -Wno-volatile \
  -nostartfiles -Wl,--gc-sections -Wl,-Map="$out/image.map" -T "$here/board.ld" -I "$root" \
  "$here/start.cpp" "$here/semihosting.cpp" "$here/main.cpp" -o "$out/image.elf.new" --specs=nano.specs --specs=nosys.specs
# Integers only, and no heap: a symbol of either says that something slipped in.
forbidden=$("${compiler%g++}nm" "$out/image.elf.new" | grep -E ' (__aeabi_[fd][a-z0-9]+|__aeabi_[a-z]+2[fd]|malloc|free|_Zn[wa]|_Zd[la]|__cxa_throw)' || true)
[ -z "$forbidden" ] || {
  echo "the image holds floating point, heap or exceptions: $forbidden" >&2
  exit 1
}
# Flash, and RAM without the telemetry ring of 8 KB and the residual map of 3848 bytes but with the stack; the linker script holds both to their limits.
size=${compiler%g++}size
"$size" -A "$out/image.elf.new" | awk '
  $1 == ".text" || $1 == ".data" { flash += $2 }
  $1 == ".data" || $1 == ".bss" || $1 == ".stack" { ram += $2 }
  END { printf "flash %d of 24576 bytes, RAM %d of 6144 bytes beside the telemetry ring and the residual map\n", flash, ram - 8192 - 3848 }'
mv "$out/image.elf.new" "$out/image.elf"
