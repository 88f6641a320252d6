#!/bin/sh
# check_effect.sh OUT NAME [FOLDER]: compiles the header of effect NAME with every number system, and says where pack refuses
# it. FOLDER/shared is looked at before the project's own. Exit code 1: it does not compile, or is refused at its usual size.
set -eu
out=$1 name=$2 folder=${3:-}
root=$(cd -- "$(dirname -- "$0")/../.." && pwd)
mkdir -p "$out"
"${CXX:-c++}" -std=c++20 -O0 -Wall -Wextra -Werror -fmax-errors=5 ${folder:+"-I$folder"} "-I$root" -isystem /usr/include/eigen3 \
  "-DEFFECT_NAME=\"$name\"" "$root/tests/support/effect_check.cpp" "$root/host/output/interchange/c_statements.cpp" -lfmt \
  -o "$out/check_effect" || exit 1
"$out/check_effect"
