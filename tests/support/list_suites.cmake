# Writes a file of ctest's with one test for six suites of `program`, named after all of them, so that `ctest -R` finds each: to
# start the program under the sanitizers takes 0.3 s of processor time, as long as all tests of many a suite; tests in one process share what
# they begin with.
# They take long, so they begin before single tests, whose COST is none.
# cmake -Dprogram=... -Dout=... -Dtimeout=SECONDS -P list_suites.cmake
execute_process(COMMAND ${program} --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${program} does not list its tests: ${status}")
endif()
string(REGEX REPLACE "[;\\[\\]]" "_" listed "${listed}")
string(REPLACE "\n" ";" lines "${listed}")
set(suites "")
foreach(line IN LISTS lines)
  # A suite stands at the beginning of its line and ends with a full stop; a comment on its type may follow.
  if(line MATCHES "^([A-Za-z0-9_/]+)\\.( |$)")
    list(APPEND suites ${CMAKE_MATCH_1})
  endif()
endforeach()
set(text "")
list(LENGTH suites count)
set(first 0)
while(first LESS count)
  list(SUBLIST suites ${first} 6 some)
  math(EXPR first "${first} + 6")
  list(JOIN some "," name)
  list(JOIN some ".*:" filter)
  string(APPEND text "add_test(\"${name}\" \"${program}\" \"--gtest_filter=${filter}.*\")\n"
    "set_tests_properties(\"${name}\" PROPERTIES TIMEOUT ${timeout} COST 100)\n")
endwhile()
if(text STREQUAL "")
  message(FATAL_ERROR "${program} lists no suite")
endif()
file(WRITE ${out} "${text}")
