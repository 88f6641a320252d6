# Run in the guest, with flexspline-hil twin --usbip outside: a program of one's own, in Python, reads telemetry of a drive over USB by
# the protocol's header and nothing else, by both of hidapi's ways; and says what is wrong where there is no drive.
export PYTHONHOME=/python
flexspline export --protocol-header --out protocol.h >said.txt 2>&1 || { cat said.txt; fail "there is no header"; }
read_telemetry() { # WAY FRAMES
  library=$(find /lib /usr/lib -name "libhidapi-$1.so.0" | head -n 1)
  LD_PRELOAD=$library python3 /examples/read_telemetry.py --header protocol.h --frames "$2" --every 40 \
    --channels velocity,current,temperature,motor_turns >said.csv 2>said.txt
}
rows_come() { [ -s said.csv ]; }

for way in libusb hidraw; do
  read_telemetry $way 1 && fail "it reads a drive that is not there"
  expect "no drive is on USB" said.txt
  unexpected traceback said.txt
  attach 1-1
  start=$(cut -d ' ' -f 1 /proc/uptime)
  read_telemetry $way 500 || { cat said.txt; fail "it ended with an error"; }
  echo "by $way: 500 frames in $(echo "$start $(cut -d ' ' -f 1 /proc/uptime)" | awk '{printf "%.1f", $2 - $1}') s; $(cat said.txt)"
  expect "# drive TWIN, 20000 ticks a second" said.txt
  expect "time_s,velocity [rad/s],current [A],temperature [degC],motor_turns [turns]" said.csv
  # A drive at rest in a warm room: the noise of its sensors. Frames are 40 ticks apart, but for those that are said to be lost.
  lost=$(awk '/ frames lost/ {n += $2} END {print n + 0}' said.txt)
  awk -F, -v lost="$lost" '
    NR == 1 { next }
    $2 < -5 || $2 > 5 || $3 < -0.5 || $3 > 0.5 || $4 < 5 || $4 > 60 || NF != 5 { print "no drive at rest: " $0; bad = 1 }
    { last = $1 }
    END {
      want = (NR - 2 + lost) * 40 / 20000
      if (NR != 501 || last < want - 1e-6 || last > want + 1e-6) { print NR - 1 " rows until " last " s, not " want; bad = 1 }
      exit bad
    }' said.csv || fail "that is no telemetry of a drive at rest"
  # The plug, in the middle of it.
  rm said.csv
  read_telemetry $way 1000000 &
  reader=$!
  until_true 60 rows_come || fail "nothing comes"
  detach 00
  code=0
  wait $reader || code=$?
  [ $code -eq 1 ] || { cat said.txt; fail "without a plug it ended with $code"; }
  expect "the drive is gone" said.txt
  unexpected traceback said.txt
done
