# Reads ctest's JUnit files; writes the messages of skipped tests, then the totals as the last line.
# A process of GoogleTest may run many tests: those that it says are counted. Only what certainly passed counts as passed; a
# test that could not be started, or during which its process ended, counts as failed.
# -v dearest=N also writes how long each of the files took, and the N tests that took longest. They shared the cores with others.
function unescape(s) {
  gsub(/&lt;/, "<", s); gsub(/&gt;/, ">", s); gsub(/&quot;/, "\"", s); gsub(/&apos;/, "\047", s); gsub(/&amp;/, "\\&", s)
  return s
}
function fail(what) { failed++; failures = failures "  " what "\n" }
function took(s, what,    i) {
  for (i = n_dear; i > 0 && dear_s[i] < s; --i)
    if (i < dearest) { dear_s[i + 1] = dear_s[i]; dear[i + 1] = dear[i] }
  if (i >= dearest) return
  dear_s[i + 1] = s; dear[i + 1] = what
  if (n_dear < dearest) n_dear++
}
function skip(what, why) { skipped++; reasons = reasons "  " what ": " (why == "" ? "no reason given" : why) "\n" }
# The name of a test in a line of GoogleTest: "[ RUN      ] Suite.Name", "[       OK ] Suite.Name (3 ms)".
function named(line) { sub(/^.*\[[ A-Z]*\] /, "", line); sub(/,? .*/, "", line); return unescape(line) }
function time_in(line) { sub(/.*\(/, "", line); return line / 1000 }
function close_process() {
  if (name == "") return
  if (announced == "") took(seconds, name)
  if (announced != "") {
    passed += ok
    if (running != "") { fail(running); seen++ }
    if (seen < announced) fail(name ": " announced " tests, of which " seen " ended")
    else if (status != "run" && !failures_here && running == "" && !(status == "notrun" && by_test)) fail(name)
  }
  else if (status == "run") passed++
  else if (status == "disabled") skip(name, "disabled in the source")
  else if (status == "notrun" && by_test) skip(name, reason)
  else fail(name)
  name = ""
}
# Output of a test cannot be mistaken for these: its < and > are escaped.
/^\t<testcase name="/ {
  close_process()
  name = $0; sub(/^\t<testcase name="/, "", name); sub(/" classname=.*/, "", name); name = unescape(name)
  status = $0; sub(/.* status="/, "", status); sub(/".*/, "", status)
  seconds = $0; sub(/.* time="/, "", seconds); seconds += 0
  by_test = 0; reason = ""; reading = 0; announced = ""; running = ""; ok = 0; seen = 0; failures_here = 0
  next
}
/^\t*<testsuite |^\ttime="/ && match($0, /time="[0-9.]+"/) { file_s[FILENAME] = substr($0, RSTART + 6, RLENGTH - 7) }
/^\t\t<skipped message="SKIP_/ { by_test = 1 }
/\[==========\] Running [0-9]+ tests? from/ && announced == "" {
  announced = $0; sub(/.*Running /, "", announced); announced = announced + 0
}
/\[ RUN      \] / { running = named($0); reason = "" }
/\[       OK \] .* ms\)$/ { took(time_in($0), named($0)); ok++; seen++; running = "" }
/\[  FAILED  \] .* ms\)$/ { took(time_in($0), named($0)); fail(named($0)); failures_here = 1; seen++; running = "" }
/\[  SKIPPED \] .* ms\)$/ { skip(named($0), reason); seen++; running = "" }
/\[  SKIPPED \]/ { reading = 0 }
reading && $0 != "" { reason = reason (reason == "" ? "" : " ") unescape($0) }
/: Skipped$/ { reading = 1 }
END {
  close_process()
  for (file in file_s) if (dearest) printf "\n%s: %d s of tests\n", file, file_s[file]
  if (n_dear) printf "\nDearest:\n"
  for (i = 1; i <= n_dear; ++i) printf "%7.1f s  %s\n", dear_s[i], dear[i]
  if (reasons != "") printf "\nSkipped:\n%s", reasons
  if (failures != "") printf "\nFailed:\n%s", failures
  printf "\n%d passed, %d failed, %d skipped\n", passed, failed, skipped
  exit (failed > 0 || passed + failed + skipped == 0) ? 1 : 0
}
