#!/bin/sh
# Builds the image: build.sh OUT_DIR makes nucleo-f446re (.elf, .bin, .map). Exit 3 where there is no ARM compiler.
set -eu
out=${1:?usage: build.sh OUT_DIR}
here=$(cd -- "$(dirname -- "$0")" && pwd)
"$here/../stm32f4/build_application.sh" nucleo_f446re "$out" nucleo-f446re
