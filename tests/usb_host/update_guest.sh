# Run in the guest, with flexspline-hil twin --usbip outside: firmware updates by dfu-util and by flexspline flash, on a drive that
# the operating system takes for a real one. It leaves the bus for its boot loader and comes back, so somebody has to put
# the plug in again each time: USB/IP does not do that by itself.

device_is() { # PRODUCT
  for vendor in /sys/bus/usb/devices/*/idVendor; do
    grep -qsx 1209 "$vendor" && grep -qsx "$1" "${vendor%Vendor}Product" && return 0
  done
  return 1
}
nothing_is_there() { ! grep -qsx 1209 /sys/bus/usb/devices/*/idVendor; }
plug_in_for_ever() {
  while sleep 0.2; do
    no nothing_is_there || usbip --tcp-port "$TWIN_PORT" attach -r "$TWIN_HOST" -b 1-1 >/tmp/plug.txt 2>&1 || true
  done
}
drive_is_back() { device_is 0001 && ls /dev/hidraw* >/dev/null 2>&1; }
loader_is_there() { device_is 0002; }
goes_to_loader() {
  dfu-util -e -E 0 >said.txt 2>&1 || { cat said.txt; fail "dfu-util -e"; }
  until_true 60 loader_is_there || fail "the boot loader did not come"
}
firmware_is() { # VERSION
  flexspline drives >drives.txt 2>&1 || fail "flexspline drives"
  grep -qF "firmware $1)" drives.txt || { cat drives.txt; return 1; }
}
refused() { # TEXT COMMAND...
  text=$1 code=0
  shift
  "$@" >said.txt 2>&1 || code=$?
  [ $code -ne 0 ] || { cat said.txt; fail "$* was not refused"; }
  expect "$text" said.txt
  echo "  refused: $(tr '\r' '\n' <said.txt | grep -F -- "$text" | tail -n 1)"
}
must() {
  "$@" >said.txt 2>&1 || { code=$?; cat said.txt; fail "$* ended with $code"; }
}

mkdir -p /dev/pts
mount -t devpts none /dev/pts
plug_in_for_ever &
until_true 60 drive_is_back || fail "no drive"

echo "run-time, by dfu-util:"
must dfu-util -l
expect "Found Runtime: [1209:0001]" said.txt
expect 'serial="TWIN"' said.txt
until_true 20 firmware_is 0.1 || fail "not the factory's firmware"

echo "boot loader, by dfu-util:"
goes_to_loader
must dfu-util -l
expect "Found DFU: [1209:0002]" said.txt
expect 'name="twin"' said.txt
must dfu-util -U up.image
cmp up.image /images/0.1.image || fail "what was uploaded is not what runs"
refused "status(1)" dfu-util -D /images/other.image
rm up.image
must dfu-util -U up.image
cmp up.image /images/0.1.image || fail "a refusal changed the image"
refused "completion packet" dfu-util -D /images/short.image
# What dfu-util makes of an error after the last block is its own affair; it has to show it.
dfu-util -D /images/bad.image >said.txt 2>&1 || true
expect "status(7)" said.txt
refused "status(2)" dfu-util -D /images/noise.image
refused "status(2)" dfu-util -D /images/unsigned.image
# Its signature is checked once it is there.
dfu-util -D /images/stranger.image >said.txt 2>&1 || true
expect "status(2)" said.txt
must dfu-util -D /images/0.2.dfu
expect "Done!" said.txt
unexpected "invalid dfu suffix" said.txt
until_true 60 drive_is_back || fail "the drive did not come back after dfu-util -D"
until_true 20 firmware_is 0.2 || fail "not what dfu-util sent"
echo "  firmware 0.2 runs after dfu-util -D"

echo "by flexspline flash --firmware:"
refused "is for board other" flexspline flash --firmware /images/other.image
refused "is truncated" flexspline flash --firmware /images/short.image
refused "is damaged" flexspline flash --firmware /images/bad.image
refused "is not a firmware image" flexspline flash --firmware /images/noise.image
refused "--older" flexspline flash --firmware /images/0.1.image
device_is 0001 || fail "a refusal sent the drive to its boot loader"
# On a terminal it shows how far it is.
must script -q -e -c "NO_COLOR=1 TERM=xterm flexspline flash --firmware /images/0.3.image --yes" /dev/null
expect "sending: " said.txt
expect "waiting for the drive" said.txt
expect "Firmware 0.3 runs" said.txt
until_true 20 firmware_is 0.3 || fail "not what flexspline sent"
echo "  firmware 0.3 runs after flexspline flash, with $(tr '\r' '\n' <said.txt | grep -c 'sending: ') reports of progress"
must flexspline record --plan /drive/plan.toml --out recorded
expect "1 of 1 runs" said.txt
echo "  the drive runs: $(grep samples said.txt)"

# From the boot loader, and back to an older one.
goes_to_loader
must flexspline flash --firmware /images/0.1.image --older
expect "in its boot loader" said.txt
expect "Firmware 0.1 runs" said.txt
# Two seconds of its ticks, and the image has confirmed itself. One that hangs is tried, taken back, and said to be so.
must flexspline record --plan /drive/plan.toml --out again
code=0
flexspline flash --firmware /images/hangs.image >said.txt 2>&1 || code=$?
[ $code -eq 1 ] || { cat said.txt; fail "an image that hangs ended with $code"; }
expect "rolled back; 0.1 runs" said.txt
echo "  $(tail -n 1 said.txt)"
# Signed by another key: refused by the drive, which goes on with what it had.
refused "is not signed with the key" flexspline flash --firmware /images/stranger.image
must flexspline flash --firmware /images/counter.image
must flexspline record --plan /drive/plan.toml --out counted
refused "smaller security counter" flexspline flash --firmware /images/0.3.image --older
must flexspline flash --firmware /images/counter.image --older
expect "Firmware 0.6 runs" said.txt
dmesg | grep -iE 'usb|hid|vhci' >kernel.txt || fail "the kernel says nothing of USB"
unexpected 'descriptor read|bogus|babble|BUG|oops' kernel.txt
