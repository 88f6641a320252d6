# The workbench's page, put into the executable as it was built by npm (page/README.md); building the tool needs no npm.
set(workbench_built ${PROJECT_SOURCE_DIR}/host/app/workbench/page/built)
file(READ ${workbench_built}/index.html WORKBENCH_PAGE)
file(READ ${workbench_built}/page.js WORKBENCH_SCRIPT)
file(READ ${workbench_built}/page.css WORKBENCH_STYLE)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
  ${workbench_built}/index.html ${workbench_built}/page.js ${workbench_built}/page.css)
configure_file(${PROJECT_SOURCE_DIR}/host/app/workbench/assets.cpp.in ${PROJECT_BINARY_DIR}/generated/host/app/workbench/assets.cpp @ONLY)
target_sources(flexspline_outer PRIVATE ${PROJECT_BINARY_DIR}/generated/host/app/workbench/assets.cpp)
# Both compilers take longer texts than the language promises.
set_source_files_properties(${PROJECT_BINARY_DIR}/generated/host/app/workbench/assets.cpp PROPERTIES
  COMPILE_OPTIONS -Wno-overlength-strings)
