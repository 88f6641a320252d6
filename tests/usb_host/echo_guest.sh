# Run in the guest, with echo_twin and its two devices outside: Linux's own USB stack, usbip, lsusb and hidapi against shared/usb.

usbip --tcp-port "$TWIN_PORT" list -r "$TWIN_HOST" >list.txt 2>&1 || fail "usbip list"
expect "1-1:" list.txt
expect "1-2:" list.txt
expect "(1209:0001)" list.txt
expect "(03/00/00)" list.txt

attach 1-1
# With its driver taken off, lsusb reads the report descriptor as well.
for part in whole bare; do
  lsusb -v -d 1209:0001 >$part.txt 2>$part.errors || fail "lsusb -v"
  [ ! -s $part.errors ] || { cat $part.errors; fail "lsusb -v has something to complain of"; }
  unexpected 'unknown|error|warning|invalid|bad|junk|truncated|short|timeout|not? support.*descriptor' $part.txt
  for text in "iManufacturer           1 Flexspline" "iProduct                2 Flexspline drive" "iSerial                 3 ECHO1" \
    "wTotalLength       0x0029" "bNumEndpoints           2" "wDescriptorLength      25" "EP 1 IN" "EP 1 OUT" "Self Powered"; do
    expect "$text" $part.txt
  done
  [ $part = bare ] || echo 1-1:1.0 >/sys/bus/usb/drivers/usbhid/unbind
done
unexpected 'UNAVAILABLE' bare.txt
expect "Report Count, data= [ 0x40 ] 64" bare.txt
expect "End Collection" bare.txt
echo "lsusb -v is clean: $(wc -l <bare.txt) lines"
echo 1-1:1.0 >/sys/bus/usb/drivers/usbhid/bind
until_true 5 drive_is_there || fail "the driver does not come back"

for way in hidraw libusb; do
  echo "by $way:"
  echo_check_$way echo ECHO1 300 || fail "echo by $way"
  [ -e /dev/hidraw0 ] || { echo 1-1:1.0 >/sys/bus/usb/drivers/usbhid/bind; until_true 5 drive_is_there; }
done

# Configured away, and again; then reset, after which the kernel begins with the descriptors.
echo 0 >/sys/bus/usb/devices/1-1/authorized
until_true 5 no test -e /dev/hidraw0 || fail "the interface stayed without a configuration"
echo 1 >/sys/bus/usb/devices/1-1/authorized
until_true 5 drive_is_there || fail "the configuration did not come back"
usbreset 1209:0001 >reset.txt 2>&1 || { cat reset.txt; fail "usbreset"; }
until_true 5 drive_is_there || fail "the device did not come back after a reset"
echo_check_hidraw echo ECHO1 50 || fail "echo after a reset"

detach 00
attach 1-1
echo_check_hidraw echo ECHO1 50 || fail "echo after attaching again"
# Two at once, by serial number.
attach 1-2
until_true 5 test -e /dev/hidraw1 || fail "the second device did not come"
echo_check_hidraw echo ECHO2 50 || fail "echo of the second device"
echo_check_hidraw echo ECHO1 50 || fail "echo of the first beside it"

# The device pulls its own plug while it is in use.
for way in hidraw libusb; do
  echo_check_$way pull ECHO2 || fail "pulled out under $way"
  until_true 5 no test -e /dev/hidraw1 || fail "the second device stayed"
  sleep 1
  attach 1-2
  until_true 5 test -e /dev/hidraw1 || fail "the second device did not come back"
  echo_check_hidraw echo ECHO2 20 || fail "echo after the plug was pulled under $way"
done
dmesg | grep -iE 'usb|hid|vhci' >kernel.txt || fail "the kernel says nothing of USB"
# What a device out of order makes the kernel say.
unexpected 'unable to|descriptor read|not accepting|invalid|bogus|babble|stall|warning|BUG|oops' kernel.txt
echo "the kernel has no complaint in $(wc -l <kernel.txt) lines"
