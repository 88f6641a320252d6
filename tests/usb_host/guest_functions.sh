# For scripts of the guest. Each ends the script with a reason where something is not as it has to be.
# TWIN_HOST and TWIN_PORT say where the twin is.

fail() {
  echo "FAILED: $*"
  exit 1
}

# until_true SECONDS COMMAND...
until_true() {
  tries=$(($1 * 20))
  shift
  while ! "$@"; do
    tries=$((tries - 1))
    [ $tries -gt 0 ] || return 1
    sleep 0.05
  done
}

no() { ! "$@"; }

# The drive among the devices of the USB stack, and its report node.
drive_is_there() { grep -qs 1209 /sys/bus/usb/devices/*/idVendor && ls /dev/hidraw* >/dev/null 2>&1; }
drive_is_gone() { ! grep -qs 1209 /sys/bus/usb/devices/*/idVendor; }

# attach [BUS_ID]: plugs in; back when the operating system is done with it.
attach() {
  usbip --tcp-port "$TWIN_PORT" attach -r "$TWIN_HOST" -b "${1:-1-1}" >/tmp/usbip.txt 2>&1 ||
    { cat /tmp/usbip.txt; fail "usbip attach ${1:-1-1}"; }
  until_true 10 drive_is_there || fail "no device appeared after attach ${1:-1-1}"
}
# detach [PORT]: pulls out, as the operating system sees it.
detach() {
  usbip detach -p "${1:-00}" >/tmp/usbip.txt 2>&1 || { cat /tmp/usbip.txt; fail "usbip detach ${1:-00}"; }
  until_true 10 drive_is_gone || fail "the device stayed after detach"
}

# expect TEXT FILE, unexpected PATTERN FILE
expect() { grep -qF -- "$1" "$2" || { cat "$2"; fail "'$1' is not in $2"; }; }
unexpected() { ! grep -iE -- "$1" "$2" || { cat "$2"; fail "'$1' is in $2"; }; }
