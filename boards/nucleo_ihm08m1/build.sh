#!/bin/sh
# Builds the images: build.sh OUT_DIR makes ihm08m1 and ihm08m1-index (.elf, .bin, .map); the second has an index pulse of
# the motor's encoder. COUNTS=N: counts a turn of that encoder, four for each of its lines (default: 4096). Exit 3 where
# there is no ARM compiler.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
counts=-DFLEXSPLINE_ENCODER_COUNTS=${COUNTS:-4096}
FLAGS=$counts "$here/../stm32f4/build_application.sh" nucleo_ihm08m1 "$out" ihm08m1
FLAGS="$counts -DFLEXSPLINE_INDEXED" "$here/../stm32f4/build_application.sh" nucleo_ihm08m1 "$out" ihm08m1-index
