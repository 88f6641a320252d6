#!/bin/sh
# Builds the images: build.sh OUT_DIR makes ihm08m1, ihm08m1-index, whose motor's encoder has an index pulse, and
# ihm08m1-abs with encoders that know their angle (.elf, .bin, .map). COUNTS=N: counts a turn of the motor's quadrature
# encoder, four for each of its lines (default: 4096). Exit 3 where there is no ARM compiler.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
counts=$("$here/../stm32f4/encoder_counts.sh" 4096)
FLAGS=$counts "$here/../stm32f4/build_application.sh" nucleo_ihm08m1 "$out" ihm08m1
FLAGS="$counts -DFLEXSPLINE_INDEXED" "$here/../stm32f4/build_application.sh" nucleo_ihm08m1 "$out" ihm08m1-index
FLAGS=-DFLEXSPLINE_ABSOLUTE "$here/../stm32f4/build_application.sh" nucleo_ihm08m1 "$out" ihm08m1-abs
