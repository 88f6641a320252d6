#!/usr/bin/env bash
# Boots Debian's kernel in QEMU and runs a script in it, with a twin outside that offers USB devices on this machine's loopback.
# What the script prints comes out here; its exit code is this one's. Nothing is installed and nobody has to be root.
#
#   guest.sh --work DIR --script FILE [--program PATH]... [--file PATH:IN_GUEST]... [--python MODULE]...
#            [--twin COMMAND] [--seconds N]
#
#   --work DIR      for what is made on the way; the kernel is fetched into DIR/../kernel once (kernel.sh)
#   --script FILE   run by busybox's sh, with the functions and variables of guest_functions.sh
#   --program PATH  into the guest's /bin, with the libraries that it loads
#   --file PATH:IN_GUEST
#   --python MODULE into the guest, with Debian's Python and all that the module imports; PYTHONHOME is /python
#   --twin COMMAND  started by sh; prints `port N` once it listens, ends with 0 at SIGTERM. Runs outside of the guest, so
#                   it may be built with sanitizers
#   --seconds N     time limit of the guest (60)
#
# Exit code: the script's; 77 where no kernel can be installed (and why is printed); 124 when time ran out;
# 3 when the twin went wrong.
set -euo pipefail
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)

work='' script='' twin='' seconds=60 programs=() files=() python=()
while (($#)); do
  case $1 in
    --work) work=$2 ;;
    --script) script=$2 ;;
    --program) programs+=("$2") ;;
    --file) files+=("$2") ;;
    --python) python+=("$2") ;;
    --twin) twin=$2 ;;
    --seconds) seconds=$2 ;;
    *)
      echo "guest.sh: no option '$1'; the head of this file lists them" >&2
      exit 2
      ;;
  esac
  shift 2
done
[[ -n $work && -f $script ]] || {
  echo "guest.sh: --work and --script are needed" >&2
  exit 2
}
mkdir -p "$work"
work=$(cd "$work" && pwd)

# As GoogleTest says it, for whoever reads the test's output.
skip() {
  echo "guest.sh: Skipped"
  echo "$*"
  echo "[  SKIPPED ]"
  exit 77
}
for tool in qemu-system-x86_64 busybox usbip lsusb cpio; do
  PATH=$PATH:/usr/sbin:/sbin command -v "$tool" >/dev/null || skip "$tool is not installed; ./dev test installs it"
done

kernel=$(dirname "$work")/kernel
"$here/kernel.sh" "$kernel" || exit

# What the guest finds at its root.
root=$work/root
rm -rf "$root"
mkdir -p "$root"/{bin,dev,proc,sys,tmp,etc,run,var/lib,modules}
ln -s ../run "$root/var/run"
with_libraries() { # FILE TARGET_NAME
  local source
  source=$(PATH=$PATH:/usr/sbin:/sbin command -v "$1") || {
    echo "guest.sh: no program $1" >&2
    exit 2
  }
  cp -L "$source" "$root/bin/$2"
  # A static program, or a script, loads none.
  { ldd "$source" 2>/dev/null | grep -o '/[^ ]*' || true; } | while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    [[ -e $root$library ]] || cp -L "$library" "$root$library"
  done
}
for program in busybox usbip lsusb "${programs[@]}"; do with_libraries "$program" "$(basename "$program")"; done
if ((${#python[@]})); then
  with_libraries /usr/bin/python3 python3
  /usr/bin/python3 "$here/guest_python.py" "$root/python" "${python[@]}" || skip "Python has no ${python[*]}; ./dev test installs it"
fi
# hidapi over libusb turns strings into wide characters by the C library's converters.
gconv=$(dirname "$(find /usr/lib -path '*gconv/UTF-16.so' 2>/dev/null | head -n 1)")
if [[ -d $gconv ]]; then
  mkdir -p "$root$gconv"
  cp "$gconv"/{UTF-16,UTF-32,UNICODE}.so "$gconv"/gconv-modules* "$root$gconv" 2>/dev/null || true
  cp -r "$gconv/gconv-modules.d" "$root$gconv" 2>/dev/null || true
fi
for names in /usr/share/misc/usb.ids /var/lib/usbutils/usb.ids; do
  [[ -f $names ]] || continue
  mkdir -p "$root$(dirname "$names")"
  cp -L "$names" "$root$names"
done
mapfile -t modules <"$kernel/modules"
for module in "${modules[@]}"; do
  # Some kernels have one or the other built in.
  [[ ! -f $kernel/$module.ko ]] || cp "$kernel/$module.ko" "$root/modules"
done
cp "$kernel/modules" "$root/modules/order"
for pair in "${files[@]}"; do
  mkdir -p "$root$(dirname "${pair#*:}")"
  cp -rL "${pair%%:*}" "$root${pair#*:}"
done
cp "$here/guest_init.sh" "$root/init"
cp "$here/guest_functions.sh" "$root/etc/functions"
cp "$script" "$root/etc/script"
chmod +x "$root/init"
(cd "$root" && find . -print0 | cpio --null --quiet -o -H newc -R 0:0) | gzip -1 >"$work/initramfs.gz"

twin_process=''
# Ends the twin; false where it did not end well.
end_twin() {
  [[ -n $twin_process ]] || return 0
  local process=$twin_process status=0
  twin_process=''
  kill -TERM "$process" 2>/dev/null || true
  wait "$process" || status=$?
  ((status == 0)) || {
    echo "guest.sh: the twin ended with exit code $status:" >&2
    tail -n 40 "$work/twin.txt" >&2
    return 1
  }
}
trap end_twin EXIT
port=0
if [[ -n $twin ]]; then
  : >"$work/twin.txt"
  # With a limit of its own: should this script be killed, the twin does not stay for ever.
  timeout $((seconds + 60)) sh -c "exec $twin" >"$work/twin.txt" 2>&1 </dev/null &
  twin_process=$!
  for _ in $(seq 200); do
    port=$(awk '$1 == "port" {print $2; exit}' "$work/twin.txt")
    [[ -z $port && -d /proc/$twin_process ]] || break
    sleep 0.05
  done
  [[ -n $port ]] || {
    echo "guest.sh: the twin does not say which port it listens on" >&2
    end_twin || true
    exit 3
  }
fi

status=0
# The port reaches init as a variable of its environment: the kernel passes on what it does not know.
timeout -k 5 "$seconds" qemu-system-x86_64 -accel tcg -smp 1 -m 512 -nodefaults -display none -no-reboot -serial stdio \
  -nic user,model=e1000 -kernel "$kernel/vmlinuz" -initrd "$work/initramfs.gz" \
  -append "console=ttyS0 quiet loglevel=3 panic=-1 random.trust_cpu=on TWIN_PORT=$port" \
  </dev/null 2>"$work/qemu.txt" | tr -d '\r' | tee "$work/serial.txt" | sed -u '/^guest: exit /d; /reboot: Power down/d' || status=$?
if grep -q '^guest: exit ' "$work/serial.txt"; then
  status=$(awk '/^guest: exit / {print $3}' "$work/serial.txt")
elif ((status == 124 || status == 137)); then
  echo "guest.sh: no end within $seconds s" >&2
  status=124
else
  echo "guest.sh: the guest broke off (QEMU's exit code $status):" >&2
  tail -n 20 "$work/qemu.txt" >&2
  status=1
fi
end_twin || status=3
exit "$status"
