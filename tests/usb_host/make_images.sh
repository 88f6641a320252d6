#!/usr/bin/env bash
# make_images.sh FLEXSPLINE FLEXSPLINE_HIL FOLDER: images for the twin, and some that have to be refused.
set -euo pipefail
tool=$1 hil=$2 folder=$3
mkdir -p "$folder"
cd "$folder"
"$hil" image --minor 1 --out 0.1.image # what the twin comes with
"$hil" image --minor 2 --bytes 30000 --out 0.2.image
"$hil" image --minor 3 --bytes 40001 --out 0.3.image
"$hil" image --minor 4 --hangs --out hangs.image
"$hil" image --minor 5 --unsigned --out unsigned.image
"$hil" image --minor 6 --counter 1 --out counter.image
# The tool's own images, with the suffix of dfu-util.
tail -c +513 0.2.image >0.2.bin
"$tool" image --program 0.2.bin --board twin --version 0.2 --dfu --out 0.2.dfu
head -c -16 0.2.dfu | cmp - 0.2.image
"$tool" image --program 0.2.bin --board other --version 0.5 --out other.image
# Of another key, and what dfu-util looks for.
"$tool" image --program 0.2.bin --board twin --version 0.5 --unsigned --out plain.image
rm -f other.key
"$tool" key --new other.key
"$tool" sign --image plain.image --key other.key --out stranger.image
head -c 20000 0.3.image >short.image
{ head -c 20000 0.3.image; printf '\377\000\377\000'; tail -c +20005 0.3.image; } >bad.image
head -c 5000 /dev/zero | tr '\000' '\125' >noise.image
touch made
