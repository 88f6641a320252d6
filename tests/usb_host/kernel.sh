#!/usr/bin/env bash
# Fetches the kernel of this Debian, and the modules that make it a USB host, into FOLDER, unless they are there. Nothing
# is installed and nobody has to be root.
#
#   kernel.sh FOLDER
#
# Exit code: 77 where no kernel can be installed; why is printed.
set -euo pipefail
kernel=${1:?kernel.sh: a folder is needed}

# In the order in which they are loaded.
modules=(e1000 usb-common usbcore usbip-core vhci-hcd hid hid-generic usbhid)

# As GoogleTest says it, for whoever reads the test's output.
skip() {
  echo "guest.sh: Skipped"
  echo "$*"
  echo "[  SKIPPED ]"
  exit 77
}
for tool in apt-get dpkg-deb; do
  PATH=$PATH:/usr/sbin:/sbin command -v "$tool" >/dev/null || skip "$tool is not installed; is this Debian?"
done

# The kernel of this Debian, taken out of its package.
# download_kernel FOLDER APT_OPTIONS...: sets `package`; false, with `reason`, where it did not come.
download_kernel() {
  local folder=$1
  shift
  package=$(apt-cache "$@" depends linux-image-amd64 2>/dev/null | awk '$1 == "Depends:" && $2 ~ /^linux-image-/ {print $2; exit}')
  reason="apt knows no package linux-image-amd64; is this Debian, and is the network there?"
  [[ -n $package ]] || return 1
  (cd "$folder" && timeout 300 apt-get "$@" -q download "$package") >"$kernel/download.log" 2>&1 && return
  reason="$package cannot be downloaded: $(grep -m 1 '^E:' "$kernel/download.log" || echo 'is the network there?')"
  return 1
}
fetch_kernel() {
  local package reason new=$kernel/new own=()
  rm -rf "$new"
  mkdir -p "$new"
  if ! download_kernel "$new"; then
    # Package lists that are missing, or older than the last update of Debian: own ones, which nobody has to be root for.
    mkdir -p "$kernel"/apt/{lists,cache/archives}/partial
    own=(-o "Dir::State::Lists=$kernel/apt/lists" -o "Dir::Cache=$kernel/apt/cache")
    timeout 300 apt-get "${own[@]}" -q update >"$kernel/update.log" 2>&1 || true
    download_kernel "$new" "${own[@]}" || skip "no kernel: $reason"
    rm -rf "$kernel/apt"
  fi
  local wanted=('./boot/vmlinuz-*')
  for module in "${modules[@]}"; do wanted+=("*/$module.ko"); done
  # Those that are built in are not found, which is no error.
  dpkg-deb --fsys-tarfile "$new"/*.deb | tar -x -C "$new" --wildcards "${wanted[@]}" 2>/dev/null || true
  mv "$new"/boot/vmlinuz-* "$new/vmlinuz" || skip "no kernel: $package holds none"
  find "$new" -name '*.ko' -exec mv {} "$new" \;
  rm -rf "$new"/*.deb "$new/boot" "$new/lib"
  mv "$new"/* "$kernel"
  printf '%s\n' "${modules[@]}" >"$kernel/modules"
  echo "$package" >"$kernel/version"
}
mkdir -p "$kernel"
exec 9>"$kernel/.lock"
flock 9
if [[ ! -f $kernel/version ]]; then
  fetch_kernel
  echo "$(<"$kernel/version") was fetched in $SECONDS s"
fi
