#!/bin/sh
# What the drive's code must not do, asked of the compiler's own call graph: drive_code.sh OUT_DIR.
# No heap, no exceptions: symbols of the object. No recursion: no cycle among the calls. Compiled without optimisation, so
# that no call has been folded away. Exit 77 where there is no ARM compiler.
set -eu
out=${1:?usage: drive_code.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
root=$(cd -- "$here/../.." && pwd)
compiler=${ARM_GXX:-arm-none-eabi-g++}
command -v "$compiler" >/dev/null || {
  echo "drive_code.sh: Skipped"
  echo "$compiler is not installed (Debian: gcc-arm-none-eabi)"
  echo "[  SKIPPED ]"
  exit 77
}
mkdir -p "$out"
cd "$out"
"$compiler" -std=c++20 -O0 -mcpu=cortex-m4 -mthumb -mfloat-abi=soft -fno-exceptions -fno-rtti -fno-threadsafe-statics \
  -Wall -Wextra -Wno-volatile -Werror -fcallgraph-info -I "$root" \
  -c "${2:-$root/boards/qemu_stm32f405/main.cpp}" -o drive_code.o

"${compiler%g++}nm" -C drive_code.o | grep -E ' U (malloc|calloc|realloc|free|operator (new|delete)|__cxa_(throw|allocate))' && {
  echo "the drive's code calls the heap, or throws"
  exit 1
}

# Nodes without callees are taken away until nothing changes; what is left is on a cycle or calls one.
awk -f "$here/cycles.awk" ./drive_code*.ci
