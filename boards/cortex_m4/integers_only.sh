#!/bin/sh
# integers_only.sh NM ELF: exit 1 where an image holds floating point, a heap or exceptions: it searches for their symbols.
set -eu
forbidden=$("$1" "$2" | grep -E ' (__aeabi_[fd][a-z0-9]+|__aeabi_[a-z]+2[fd]|malloc|free|_Zn[wa]|_Zd[la]|__cxa_throw)' || true)
[ -z "$forbidden" ] || {
  echo "the image holds floating point, heap or exceptions: $forbidden" >&2
  exit 1
}
