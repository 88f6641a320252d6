#!/usr/bin/env bash
# For campaigns that continue where the last run of the same program stopped: source it.
#
#   begin_campaign PROGRAM MINUTES FOLDER    empties FOLDER if another program was run in it; sets `until`, in SECONDS
begin_campaign() {
  local sum
  mkdir -p "$3"
  sum=$(sha256sum "$1" | cut -d ' ' -f 1)
  if [[ $(cat "$3/program" 2>/dev/null) != "$sum" ]]; then
    rm -f "$3"/*.txt
    echo "$sum" >"$3/program"
  fi
  touch "$3/done.txt"
  # shellcheck disable=SC2034  # of who sources this
  until=$(awk -v m="$2" 'BEGIN {printf "%d", 60 * m}')
  SECONDS=0
}
