#!/usr/bin/env bash
# For campaigns that continue where the last run of the same programs stopped: source it.
#
#   begin_campaign MINUTES FOLDER PROGRAM...    empties FOLDER if other programs were run in it; sets `until`, in SECONDS
begin_campaign() {
  local sum
  mkdir -p "$2"
  sum=$(cat "${@:3}" | sha256sum | cut -d ' ' -f 1)
  if [[ $(cat "$2/program" 2>/dev/null) != "$sum" ]]; then
    rm -f "$2"/*.txt
    echo "$sum" >"$2/program"
  fi
  touch "$2/done.txt"
  # shellcheck disable=SC2034  # of who sources this
  until=$(awk -v m="$1" 'BEGIN {printf "%d", 60 * m}')
  SECONDS=0
}
