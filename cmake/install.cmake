# cmake --install build [--prefix DIR]:
#   bin/gapscope                         finds its libraries by $ORIGIN
#   lib/gapscope/libgapscope_plugins.so  for any MuJoCo host of the same version; without RUNPATH
#                                        (see src/plugins/CMakeLists.txt)
#   lib/gapscope/libmujoco.so.*          where MuJoCo came with the build
#   lib/gapscope/*.a, include/gapscope   the stages as libraries; find_package(gapscope) gives
#                                        gapscope::replay, gapscope::plugins ...
#   share/gapscope/models                rigs and experiment files
#   share/man/man1/gapscope.1            made from the program's own --help
#   share/bash-completion/completions/gapscope, share/fish/vendor_completions.d/gapscope.fish
#   share/zsh/site-functions/_gapscope   of a package in /usr share/zsh/vendor-completions/_gapscope, as Debian has it
#   share/gapscope/demo/qube.csv         the log to try them with
# Components: program (with the Python package too), documents, development (headers, archives, CMake package).
include(CMakePackageConfigHelpers)
set(_libraries ${CMAKE_INSTALL_LIBDIR}/gapscope)
set(_headers ${CMAKE_INSTALL_INCLUDEDIR}/gapscope)
set(_package ${CMAKE_INSTALL_LIBDIR}/cmake/gapscope)

file(RELATIVE_PATH _bin_to_libraries ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_PREFIX}/${_libraries})
set_target_properties(gapscope PROPERTIES INSTALL_RPATH "$ORIGIN/${_bin_to_libraries}")
install(TARGETS gapscope RUNTIME COMPONENT program)

# Every folder's library that this build has, with its headers.
foreach(name core log experiment model replay compare fit tune identify design diagnose export video report plugins
             warnings)
  if(TARGET gapscope_${name})
    set_target_properties(gapscope_${name} PROPERTIES EXPORT_NAME ${name})
    install(TARGETS gapscope_${name} EXPORT gapscope LIBRARY DESTINATION ${_libraries}
            COMPONENT program ARCHIVE DESTINATION ${_libraries} COMPONENT development)
  endif()
endforeach()
foreach(folder src/core src/log src/experiment src/model src/compare src/fit src/tune src/identify
        src/design src/diagnose src/export src/video src/report replay)
  if(EXISTS ${CMAKE_SOURCE_DIR}/${folder})
    get_filename_component(_parent ${folder} DIRECTORY)
    install(DIRECTORY ${folder} DESTINATION ${_headers}/${_parent} COMPONENT development
            FILES_MATCHING PATTERN "*.h" PATTERN effects EXCLUDE)
  endif()
endforeach()
install(EXPORT gapscope NAMESPACE gapscope:: DESTINATION ${_package} FILE gapscope-targets.cmake
        COMPONENT development)

set(GAPSCOPE_MUJOCO_SONAME "")
if(GAPSCOPE_MUJOCO_LIBRARY)
  get_filename_component(GAPSCOPE_MUJOCO_SONAME ${GAPSCOPE_MUJOCO_LIBRARY} NAME)
  get_filename_component(_sdk ${GAPSCOPE_MUJOCO_LIBRARY} DIRECTORY)
  install(FILES ${GAPSCOPE_MUJOCO_LIBRARY} DESTINATION ${_libraries} COMPONENT program)
  install(DIRECTORY ${_sdk}/include/mujoco DESTINATION ${_headers} COMPONENT development)
  file(GLOB_RECURSE _licenses ${_sdk}/../*LICENSE*)
  install(FILES ${_licenses} DESTINATION ${CMAKE_INSTALL_DATADIR}/gapscope/mujoco COMPONENT program)
endif()
configure_package_config_file(cmake/gapscope-config.cmake.in ${CMAKE_BINARY_DIR}/cmake/gapscope-config.cmake
                              INSTALL_DESTINATION ${_package} PATH_VARS _libraries _headers)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/cmake/gapscope-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/cmake/gapscope-config.cmake ${CMAKE_BINARY_DIR}/cmake/gapscope-config-version.cmake
        DESTINATION ${_package} COMPONENT development)

install(DIRECTORY models schemas DESTINATION ${CMAKE_INSTALL_DATADIR}/gapscope COMPONENT program)
install(FILES demo/qube.csv DESTINATION ${CMAKE_INSTALL_DATADIR}/gapscope/demo COMPONENT documents)
install(FILES cmake/gapscope.bash RENAME gapscope DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        COMPONENT documents)
install(FILES cmake/gapscope.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT documents)
set(_zsh ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
if(CMAKE_INSTALL_PREFIX STREQUAL /usr)
  set(_zsh ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
endif()
install(FILES cmake/_gapscope DESTINATION ${_zsh} COMPONENT documents)

# The manual page says what the program says.
set(_man ${CMAKE_BINARY_DIR}/share/man/man1/gapscope.1)
add_custom_command(OUTPUT ${_man}
                   COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:gapscope> -DOUTPUT=${_man}
                           -DVERSION=${PROJECT_VERSION} -P ${CMAKE_SOURCE_DIR}/cmake/man_page.cmake
                   DEPENDS gapscope cmake/man_page.cmake VERBATIM)
add_custom_target(gapscope_man ALL DEPENDS ${_man})
install(FILES ${_man} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT documents)
