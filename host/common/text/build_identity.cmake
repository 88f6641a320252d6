# The source's revision, asked for at each build; the header is touched only where the answer is another one.
if(CMAKE_SCRIPT_MODE_FILE)
  cmake_minimum_required(VERSION 3.25)
  # Where the checkout is somebody else's, git refuses.
  execute_process(COMMAND git -C ${source} describe --always --tags --dirty=+changes
    OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  # A source archive unpacked inside another project's checkout has no revision of its own.
  if(failed OR NOT EXISTS ${source}/.git)
    set(revision unknown)
  endif()
  file(CONFIGURE OUTPUT ${output} CONTENT
    "#pragma once\n\n#include <string_view>\n\nnamespace flexspline::text {\ninline constexpr std::string_view kVersion = \"@version@\";\ninline constexpr std::string_view kRevision = \"@revision@\";\n}\n" @ONLY)
  return()
endif()

add_custom_target(flexspline_revision
  COMMAND ${CMAKE_COMMAND} -Dsource=${PROJECT_SOURCE_DIR} -Dversion=${PROJECT_VERSION}
    -Doutput=${PROJECT_BINARY_DIR}/revision/host/common/text/flexspline_revision.hpp -P ${CMAKE_CURRENT_LIST_FILE}
  BYPRODUCTS ${PROJECT_BINARY_DIR}/revision/host/common/text/flexspline_revision.hpp
  COMMENT "" VERBATIM)
add_dependencies(flexspline_host flexspline_revision)
set_source_files_properties(host/common/text/build_identity.cpp PROPERTIES
  INCLUDE_DIRECTORIES ${PROJECT_BINARY_DIR}/revision SKIP_UNITY_BUILD_INCLUSION ON)
