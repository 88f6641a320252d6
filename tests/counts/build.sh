#!/usr/bin/env bash
# Builds and runs programs on bare machines in QEMU.
#   build.sh MACHINE SOURCE ELF [FLAGS...]   MACHINE: m0 m3 m4 m7 riscv; an image for that machine in QEMU
#   build.sh run MACHINE ELF                 its output on standard output
#   build.sh key MACHINE SOURCE ELF [FLAGS...]   a number that changes with what the image would be made of
# `count-m0`, `count-m3`, `count-m4` are code for those processors on the one machine that counts instructions.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$here/../..

memory() { # flash at, length; RAM at, length
  echo "-Wl,--defsym=flash_origin=$1,--defsym=flash_length=$2,--defsym=ram_origin=$3,--defsym=ram_length=$4"
}
# No scheduling before registers are given out, and no values kept for another branch: these processors gain nothing from
# it, and spill.
common=(-std=c++20 -O2 -fno-schedule-insns -fno-tree-pre -Wall -Wextra -Werror -fno-exceptions -fno-rtti -fno-threadsafe-statics
  -ffunction-sections -fdata-sections -nostartfiles -Wl,--gc-sections -T "$here/bare.ld" -I"$root")
# The RISC-V compiler of Debian has no C++ headers; those of the ARM one are of the same library, and the few that are
# used here need nothing else.
arm_headers() {
  arm-none-eabi-g++ -mcpu=cortex-m3 -mthumb -xc++ -E -v - </dev/null 2>&1 |
    sed -n '/#include </,/^End/p' | grep -v '/lib/gcc/arm-none-eabi/[0-9.]*/include' | grep '^ ' | sed 's/^ /-isystem /' | tr '\n' ' '
}

if [[ $1 == run ]]; then
  elf=$3
  case $2 in
    m0) machine=microbit ;;
    m3) machine=lm3s6965evb ;;
    m7) machine=mps2-an500 ;;
    m4 | count-*) machine=netduinoplus2 ;;
    riscv)
      exec timeout 120 qemu-system-riscv32 -M virt -bios none -nographic -monitor none -serial stdio -kernel "$elf" </dev/null
      ;;
  esac
  # Semihosting writes to standard error, where QEMU itself has something to say of one machine's clock.
  timeout 120 qemu-system-arm -M "$machine" -nographic -monitor none -serial none \
    -semihosting-config enable=on,target=native -icount shift=0,sleep=off -kernel "$elf" </dev/null 2>&1 |
    grep -v '^Timer with period zero'
  exit
fi

key=''
if [[ $1 == key ]]; then
  key=yes
  shift
fi
machine=$1 source=$2 elf=$3
shift 3
# compile COMPILER FLAGS...; `last` are flags that have to stand behind the sources.
compile() {
  if [[ -z $key ]]; then exec "$@" "$source" "$here/bare.cpp" -o "$elf" "${last[@]}"; fi
  {
    "$1" --version
    printf '%s\n' "$@" "${last[@]}"
    cat "$here/bare.ld"
    for file in "$source" "$here/bare.cpp"; do "$@" -E "$file"; done
  } | sha256sum
  exit
}
last=()
case $machine in
  m0) target=(-mcpu=cortex-m0 -mthumb "$(memory 0 0x40000 0x20000000 0x4000)") ;;
  m3) target=(-mcpu=cortex-m3 -mthumb "$(memory 0 0x40000 0x20000000 0x10000)") ;;
  m7) target=(-mcpu=cortex-m7 -mthumb -mfloat-abi=soft "$(memory 0 0x100000 0x20000000 0x20000)") ;;
  m4) target=(-mcpu=cortex-m4 -mthumb -mfloat-abi=soft "$(memory 0x08000000 0x100000 0x20000000 0x1C000)") ;;
  count-m4) target=(-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 "$(memory 0x08000000 0x100000 0x20000000 0x1C000)") ;;
  count-m[03]) target=(-mcpu=cortex-"${machine#count-}" -mthumb "$(memory 0x08000000 0x100000 0x20000000 0x1C000)") ;;
  riscv)
    last=(-lgcc)
    # shellcheck disable=SC2046
    compile riscv64-unknown-elf-g++ "${common[@]}" -march=rv32im -mabi=ilp32 -nodefaultlibs $(arm_headers) \
      "$(memory 0x80000000 0x100000 0x80100000 0x100000)" "$@"
    ;;
  *)
    echo "no machine $machine" >&2
    exit 2
    ;;
esac
compile arm-none-eabi-g++ "${common[@]}" "${target[@]}" --specs=nosys.specs "$@"
