# Writes a file of ctest's with one test a suite of `program`: a process a test would start the sanitizers 1,900 times.
# cmake -Dprogram=... -Dout=... -Dtimeout=SECONDS -P list_suites.cmake
execute_process(COMMAND ${program} --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${program} does not list its tests: ${status}")
endif()
string(REGEX REPLACE "[;\\[\\]]" "_" listed "${listed}")
string(REPLACE "\n" ";" lines "${listed}")
set(text "")
foreach(line IN LISTS lines)
  # A suite stands at the beginning of its line and ends with a full stop; a comment on its type may follow.
  if(line MATCHES "^([A-Za-z0-9_/]+)\\.( |$)")
    set(suite ${CMAKE_MATCH_1})
    string(APPEND text "add_test(\"${suite}\" \"${program}\" \"--gtest_filter=${suite}.*\")\n"
      "set_tests_properties(\"${suite}\" PROPERTIES TIMEOUT ${timeout})\n")
  endif()
endforeach()
if(text STREQUAL "")
  message(FATAL_ERROR "${program} lists no suite")
endif()
file(WRITE ${out} "${text}")
