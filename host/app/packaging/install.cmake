# What `cmake --install` and the Debian package bring. Completion, man page and C header are asked of the tool itself, so
# they cannot differ from it.
include(GNUInstallDirs)
set(made ${PROJECT_BINARY_DIR}/installed)
add_custom_command(
  OUTPUT ${made}/flexspline.1 ${made}/flexspline.bash ${made}/_flexspline ${made}/flexspline.fish
    ${made}/flexspline_protocol.h
  COMMAND ${CMAKE_COMMAND} -E make_directory ${made}
  COMMAND flexspline man > ${made}/flexspline.1
  COMMAND flexspline completion bash > ${made}/flexspline.bash
  COMMAND flexspline completion zsh > ${made}/_flexspline
  COMMAND flexspline completion fish > ${made}/flexspline.fish
  COMMAND flexspline export --protocol-header > ${made}/flexspline_protocol.h
  DEPENDS flexspline
  COMMENT "Completion, man page and C header, from the tool"
  VERBATIM)
add_custom_target(flexspline_installed ALL DEPENDS ${made}/flexspline.1)

install(TARGETS flexspline flexspline-hil RUNTIME)
install(FILES ${made}/flexspline.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${made}/flexspline.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME flexspline)
install(FILES ${made}/_flexspline DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${made}/flexspline.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES ${made}/flexspline_protocol.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/flexspline)
# Only what lies below /usr is read by udev without more ado.
install(FILES host/drive_link/drive/70-flexspline.rules DESTINATION lib/udev/rules.d)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
# The documents keep their folders, so that links between them hold.
file(GLOB_RECURSE documents CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
  shared/*.md firmware/*.md boards/*.md hil/*.md host/*.md tests/*.md host/*.svg host/*.png tests/*.svg
  host/drive_link/drive/examples/*.py)
file(GLOB at_root CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} *.md)
foreach(document ${at_root} ${documents})
  get_filename_component(folder ${document} DIRECTORY)
  install(FILES ${document} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME flexspline)
set(CPACK_PACKAGE_VENDOR "Flexspline")
set(CPACK_PACKAGE_CONTACT "The Flexspline authors <flexspline@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "identification and diagnosis of drives with strain-wave gears")
set(CPACK_PACKAGE_DESCRIPTION "Identifies a model of a drive with a strain-wave gear from recorded motion, says which\nphysical effect the model lacks, and brings the model onto a drive.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
include(CPack)
