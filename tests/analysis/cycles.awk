# Cycles in a call graph of gcc (-fcallgraph-info). Exit 1 with the functions on them; else says how many were looked at.
/^edge:/ {
  match($0, /sourcename: "[^"]*"/); from = substr($0, RSTART + 13, RLENGTH - 14)
  match($0, /targetname: "[^"]*"/); to = substr($0, RSTART + 13, RLENGTH - 14)
  if (to == "__indirect_call") { indirect[from] = 1; next }
  if ((from, to) in seen) next
  seen[from, to] = 1
  calls[from]++
  callers[to] = callers[to] "\n" from
  edges++
  nodes[from] = nodes[to] = 1
}
/^node:/ {
  match($0, /title: "[^"]*"/); title = substr($0, RSTART + 8, RLENGTH - 9)
  match($0, /label: "[^"]*"/); label = substr($0, RSTART + 8, RLENGTH - 9); sub(/\\n.*/, "", label)
  names[title] = label
}
END {
  for (n in nodes) { count++; if (!(n in calls)) { queue[++last] = n } }
  for (at = 1; at <= last; at++) {
    parts = split(substr(callers[queue[at]], 2), above, "\n")
    for (i = 1; i <= parts; i++) if (above[i] != "" && --calls[above[i]] == 0) queue[++last] = above[i]
  }
  if (count == 0 || edges == 0) { print "no call graph was read"; exit 1 }
  for (n in calls) if (calls[n] > 0) { print "on a cycle of calls, or above one: " (n in names ? names[n] : n); bad = 1 }
  if (bad) exit 1
  for (n in indirect) hidden++
  printf "%d functions, %d calls, no cycle; %d functions call through pointers, which this does not follow\n", count, edges, hidden
}
