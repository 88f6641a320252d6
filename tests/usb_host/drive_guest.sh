# Run in the guest, with flexspline-hil twin --usbip outside: the tool's commands on a drive that the operating system takes for
# a real one, by both of hidapi's ways, and the plug pulled in the middle of them.

# Both back ends have the same functions, so the one that is loaded first is the tool's, whichever it was linked to.
for way in hidraw libusb; do
  library=$(find /lib /usr/lib -name "libhidapi-$way.so.0" | head -n 1)
  [ -n "$library" ] || fail "libhidapi-$way is not in the guest"
  printf '#!/bin/sh\nLD_PRELOAD=%s exec flexspline "$@"\n' "$library" >/bin/by_$way
  chmod +x /bin/by_$way
done
attach 1-1

# must COMMAND...: has to go well; what it says is in said.txt.
must() {
  "$@" >said.txt 2>&1 || { code=$?; cat said.txt; fail "$* ended with $code"; }
}
uptime_s() { cut -d ' ' -f 1 /proc/uptime; }
# timed NAME COMMAND...: must, and how long it took.
timed() {
  name=$1 start=$(uptime_s)
  shift
  must "$@"
  took=$(echo "$start $(uptime_s)" | awk '{printf "%.2f", $2 - $1}')
  echo "  $name: $took s"
}
hidraw_again() {
  [ -e /dev/hidraw0 ] || { echo 1-1:1.0 >/sys/bus/usb/drivers/usbhid/bind; until_true 5 drive_is_there || fail "no driver"; }
}
is_block() { # FILE BLOCK
  cmp -s "$1" "$2"
}

everything() { # TOOL
  timed drives "$1" drives
  expect "hid:TWIN" said.txt
  expect "board twin" said.txt
  timed backup "$1" backup --out made.block
  timed "flash --model" "$1" flash --model /drive/model.toml
  expect "flashed, read back and in use" said.txt
  timed "backup by serial number" "$1" backup --drive TWIN --out new.block
  no is_block made.block new.block || fail "the block is still the old one"
  timed restore "$1" restore
  must "$1" backup --out now.block
  is_block made.block now.block || fail "restore did not go back"
  timed "flash --block" "$1" flash --block new.block
  must "$1" backup --out now.block
  is_block new.block now.block || fail "what was flashed reads back as another block"
  timed "backup --previous" "$1" backup --previous --out now.block
  is_block made.block now.block || fail "the block before is another one"
  timed "monitor for 1 s" "$1" monitor --seconds 1
  [ "$(grep -c . said.txt)" -ge 8 ] || { cat said.txt; fail "monitor says too little"; }
  timed "record 2 s" "$1" record --plan /drive/plan.toml --out "recorded-$1"
  expect "1 of 1 runs" said.txt
  grep samples said.txt
  # hidapi holds so many reports and no more: what a guest that stands still for a while loses is counted, every frame.
  samples=$(awk '/ samples, / {print $2; exit}' said.txt)
  lost=$(awk '/ frames were lost / {for (i = 2; i <= NF; ++i) if ($i == "frames") print $(i - 1); exit}' said.txt)
  [ $((samples + ${lost:-0})) -ge 2000 ] || { cat said.txt; fail "$samples samples and ${lost:-no} lost ones are not two seconds"; }
  [ "$samples" -ge 1000 ] || { cat said.txt; fail "only $samples samples"; }
  [ -z "$lost" ] || expect ", 0 of them on the drive" said.txt
}

# libusb takes the device from the kernel's own driver, hidraw holds it open.
is_open() {
  # No program of its own for each look: one takes as long in this guest as the command that is looked at may run between two.
  for handle in "/proc/$command/fd"/*; do
    if [ "$handle" -ef /dev/hidraw0 ]; then return 0; fi
  done
  [ ! -e /dev/hidraw0 ]
}
# pulled MICROSECONDS COMMAND...: pulls the plug so long after the command opened the drive; sets `code`, and puts the
# plug in again. The command stands still while this script looks and pulls, so that a slow guest does not matter; it
# runs for `step` microseconds between two looks.
step=10000
send() { kill -"$1" $command 2>/dev/null || :; }
pulled() {
  delay=$1
  shift
  code=0
  hidraw_again
  "$@" >said.txt 2>&1 &
  command=$!
  until is_open; do
    if ! [ -d "/proc/$command" ]; then
      # A short one may be done before it is looked at.
      wait $command && return
      cat said.txt
      fail "$* does not open the drive"
    fi
    send CONT
    usleep $step
    send STOP
  done
  if [ "$delay" -gt 0 ]; then
    send CONT
    usleep "$delay"
    send STOP
  fi
  detach 00
  send CONT
  wait $command || code=$?
  attach 1-1
}

# was_cut WHAT: the command that was pulled says that the drive is gone and what to do, or it was done before.
was_cut() {
  echo "  pulled during $1: $code, $(tail -n 1 said.txt)"
  [ $code -eq 0 ] && return 1
  [ $code -eq 2 ] || { cat said.txt; fail "$1 without a plug ended with $code"; }
  expect "the drive is gone" said.txt
  expect "plug it in again" said.txt
}
# What the drive has in use: one of both blocks, whatever was cut short.
now_in_use() { # TOOL
  must "$1" backup --out now.block
  is_block made.block now.block && { now=made.block; other=new.block; return; }
  is_block new.block now.block || fail "the block is neither the old nor the new one"
  now=new.block other=made.block
}

cut_short() { # TOOL
  cut=0
  # What is not there yet is flashed, so that there is an old block and a new one.
  for delay in 1000 40000; do
    now_in_use "$1"
    wanted=$other
    pulled $delay "$1" flash --block $wanted
    was_cut "a flash, after $delay us" && cut=$((cut + 1))
    now_in_use "$1"
    must "$1" flash --block $wanted
    now_in_use "$1"
    [ $now = $wanted ] || fail "the second try did not flash"
  done
  [ $cut -ge 1 ] || fail "no flash was cut short"
  # Shorter than a flash: the plug is pulled as soon as they have opened the drive.
  step=2000 cut=0
  pulled 0 "$1" restore
  was_cut "a restore" && cut=$((cut + 1))
  now_in_use "$1"
  wanted=$other
  must "$1" restore
  rm -f cut.block # of the other way, where that backup was done before the plug was pulled
  pulled 0 "$1" backup --out cut.block
  if was_cut "a backup"; then
    cut=$((cut + 1))
    [ ! -e cut.block ] || fail "half a backup was left behind"
  fi
  [ $cut -ge 1 ] || fail "neither restore nor backup was cut short"
  now_in_use "$1"
  [ $now = $wanted ] || fail "the second try did not restore"
  # It lists what it has found, or says that it is gone.
  pulled 0 "$1" drives
  echo "  pulled during drives: $code, $(head -n 1 said.txt)"
  expect "TWIN" said.txt
  unexpected "your user may not|assert|terminate" said.txt
  must "$1" drives
  expect "hid:TWIN" said.txt
  pulled 300000 "$1" monitor
  was_cut "monitor" || fail "monitor went on without a plug"
  must "$1" monitor --seconds 0.3
  step=10000
  pulled 3000000 "$1" record --plan /drive/long.toml --out "cut-$1"
  was_cut "record" || fail "record went on without a plug"
  # A drive that lost its host while it was armed says so until somebody has seen it.
  must "$1" drives
  expect ", fault" said.txt
  "$1" record --plan /drive/plan.toml --out "again-$1" >said.txt 2>&1 && fail "a fault was passed over"
  expect "the host sent no command" said.txt
  expect "--clear-fault" said.txt
  must "$1" record --plan /drive/plan.toml --out "again-$1" --clear-fault --force
  expect "1 of 1 runs" said.txt
}

for way in hidraw libusb; do
  echo "by $way:"
  everything by_$way
  cut_short by_$way
  hidraw_again
done

# Who may not open it is told what to do.
echo 'user:x:1000:1000::/tmp:/bin/sh' >/etc/passwd
chmod 777 /tmp
for way in hidraw libusb; do
  [ $way = hidraw ] || chmod 644 /dev/bus/usb/*/*
  for line in "drives" "backup --out no.block" "backup --drive TWIN --out no.block"; do
    code=0
    su user -c "by_$way $line" >said.txt 2>&1 || code=$?
    echo "as a user by $way, $line: $(cat said.txt)"
    [ "$line" = drives ] || [ $code -eq 2 ] || fail "ended with $code"
    expect "70-flexspline.rules" said.txt
  done
done
detach 00
by_hidraw backup --out none.block >said.txt 2>&1 && fail "there is a drive without a plug"
expect "no drive is on USB" said.txt
