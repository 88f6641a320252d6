#!/usr/bin/env bash
# effect_costs.sh FOLDER TABLE PAGE VERSION: what each effect costs a drive. Builds the STM32F405's application with `inertia`
# alone, and with each effect more, in FOLDER; instructions are those of TABLE, which measure.sh wrote. Writes PAGE.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$(cd -- "$here/../.." && pwd)
folder=$1 table=$2 page=$3 version=$4
mkdir -p "$folder"

# Those that run on a drive: a header with a number, neither for the host only nor the one whose law is in the model file.
names=$(cd "$root/shared/effects" && grep -l '^FLEXSPLINE_EFFECT(' ./*.hpp | xargs grep -LE '\.(host_only|user_defined) = true' |
  sed 's/^\.\///; s/\.hpp$//' | sort)

build() { # NAME EFFECTS, or - for all: the line that the build prints
  EFFECTS=${2#-} FLAGS= "$root/boards/stm32f4/build_application.sh" stm32f405 "$folder/$1" application 2>"$folder/$1.log" >"$folder/$1.txt" ||
    {
      cat "$folder/$1.log" >&2
      exit 1
    }
}
export -f build
export root folder
{
  echo "none inertia"
  echo "all -"
  for name in $names; do [[ $name == inertia ]] || echo "$name inertia,$name"; done
} | xargs -P "$(nproc)" -L 1 bash -c 'build "$0" "$1"'

bytes() { sed -n "s/.*$2 *\([0-9]*\).*/\1/p" "$folder/$1.txt"; } # NAME flash|RAM
none_flash=$(bytes none flash) none_ram=$(bytes none RAM)
{
  echo "# What each effect costs a drive"
  echo
  echo "Made by \`./dev firmware costs\` at $version, not edited by hand. The application of the STM32F405 (variant dac) with the effect"
  echo "\`inertia\` alone takes $none_flash bytes of flash and $none_ram of RAM, with all effects $(bytes all flash) and $(bytes all RAM). A row has what"
  echo "one effect adds to that: an effect with a stated order has four places in a model. Instructions: of a tick on a Cortex-M4, in an image that has"
  echo "no other effect. A set costs less than the sum of its rows, as effects share functions: all of them $(($(bytes all flash) - none_flash)) bytes."
  echo
  echo "A set is chosen when the image is built: \`EFFECTS=inertia,viscous_friction,coulomb_friction boards/stm32f405/build.sh OUT dac\`,"
  echo "which prints its flash and RAM. The drive tells the host which effects it has; \`pack\` and \`flash\` refuse a model with others."
  echo
  echo "| effect | flash, bytes | RAM, bytes | instructions |"
  echo "| --- | --- | --- | --- |"
  for name in $names; do
    [[ $name == inertia ]] && continue
    echo "| \`$name\` | $(($(bytes "$name" flash) - none_flash)) | $(($(bytes "$name" RAM) - none_ram)) | $(awk -v name="$name" '$1 == "m4" && $2 == name { print $4; exit }' "$table") |"
  done
} >"$page"
cat "$page"
