#!/bin/busybox sh
# The guest's first and only process: devices, modules, network, then the script.
/bin/busybox --install -s /bin
export PATH=/bin HOME=/tmp LANG=C.UTF-8
mount -t proc none /proc
mount -t sysfs none /sys
mount -t devtmpfs none /dev
while read -r module; do
  [ ! -f "/modules/$module.ko" ] || insmod "/modules/$module.ko" || echo "guest: module $module was not loaded"
done </modules/order
ifconfig lo 127.0.0.1 up
ifconfig eth0 10.0.2.15 netmask 255.255.255.0 up
mkdir -p /run/vhci_hcd
export TWIN_PORT TWIN_HOST=10.0.2.2
(
  cd /tmp
  set -eu
  . /etc/functions
  . /etc/script
) </dev/null 2>&1
echo "guest: exit $?"
sync
poweroff -f
