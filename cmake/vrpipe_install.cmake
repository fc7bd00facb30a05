# `cmake --install`, and find_package(vrpipe) for units, platforms and testbenches outside the tree.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/vrpipe)

set(installed_targets vrpipe_core vrpipe_options vrpipe)
if(TARGET vrpipe_testkit)
  list(APPEND installed_targets vrpipe_testkit)
  set_target_properties(vrpipe_testkit PROPERTIES EXPORT_NAME testkit)
endif()
set_target_properties(vrpipe_options PROPERTIES EXPORT_NAME options)
set_target_properties(vrpipe_core PROPERTIES EXPORT_NAME vrpipe)
set_target_properties(vrpipe PROPERTIES EXPORT_NAME command)
install(TARGETS ${installed_targets} EXPORT vrpipe)

foreach(part interfaces platforms workloads testkit)
  install(DIRECTORY ${part}/vrpipe DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
endforeach()

# Of the shipped units, for units that derive from them: <vrpipe/modules/crop/crop.h>.
install(DIRECTORY modules/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/vrpipe/modules FILES_MATCHING PATTERN "*.h")

configure_package_config_file(cmake/vrpipe-config.cmake.in vrpipe-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(vrpipe-config-version.cmake COMPATIBILITY SameMinorVersion)
install(EXPORT vrpipe NAMESPACE vrpipe:: DESTINATION ${package_dir} FILE vrpipe-targets.cmake)
install(FILES ${PROJECT_BINARY_DIR}/vrpipe-config.cmake ${PROJECT_BINARY_DIR}/vrpipe-config-version.cmake
  cmake/vrpipe_plugin.cmake DESTINATION ${package_dir})

# The documents as they lie here, so that their links hold; and the projects that build against an installation.
set(documents ${CMAKE_INSTALL_DATADIR}/doc/vrpipe)
install(DIRECTORY docs DESTINATION ${documents})
install(DIRECTORY modules DESTINATION ${documents} FILES_MATCHING PATTERN "README.md")
install(FILES README.md CONTRIBUTING.md CHANGELOG.md LICENSE DESTINATION ${documents})
install(FILES tools/jobs/paper_rows.toml DESTINATION ${documents}/tools/jobs)
install(DIRECTORY tests/install/consumer/ DESTINATION ${CMAKE_INSTALL_DATADIR}/vrpipe/examples)
