# The plugin library for hosts of several MuJoCo versions: plugins/VERSION/libgapscope_plugins.so of the Python package.
# Struct layouts change from minor version to minor version, so each is compiled against the headers of its own wheel.
# A version whose wheel scripts/wheel has not fetched is left out.
set(_destination plugins)
# A component of its own: `cmake --install` without --component leaves it out.
install(TARGETS gapscope_plugins LIBRARY DESTINATION ${_destination}/${GAPSCOPE_MUJOCO_VERSION}
        COMPONENT wheel EXCLUDE_FROM_ALL)
add_custom_target(gapscope_wheel_plugins DEPENDS gapscope_plugins)

get_target_property(_sources gapscope_plugins SOURCES)
list(TRANSFORM _sources PREPEND ${CMAKE_SOURCE_DIR}/src/plugins/)
set(CMAKE_SKIP_RPATH ON)
foreach(_wheel mujoco_core-4.0.0 mujoco-3.17.0 mujoco-3.16.0 mujoco-3.15.0 mujoco-3.14.0)
  string(REGEX REPLACE ".*-" "" _version ${_wheel})
  file(GLOB _file ${GAPSCOPE_CACHE_DIR}/${_wheel}-cp311-*.whl)
  if(NOT _file)
    continue()
  endif()
  set(_sdk ${CMAKE_BINARY_DIR}/wheel/mujoco-${_version})
  if(NOT EXISTS ${_sdk}/mujoco/include/mujoco/mujoco.h)
    file(ARCHIVE_EXTRACT INPUT ${_file} DESTINATION ${_sdk} PATTERNS "mujoco/include/*" "mujoco/libmujoco.so.*")
  endif()
  set(_target gapscope_plugins_${_version})
  add_library(${_target} SHARED EXCLUDE_FROM_ALL ${_sources})
  set_target_properties(${_target} PROPERTIES OUTPUT_NAME gapscope_plugins UNITY_BUILD ${GAPSCOPE_UNITY}
                        LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/wheel/plugins/${_version})
  target_include_directories(${_target} PRIVATE ${CMAKE_SOURCE_DIR})
  target_include_directories(${_target} SYSTEM PRIVATE ${_sdk}/mujoco/include)
  file(GLOB _lib ${_sdk}/mujoco/libmujoco.so.*)
  target_link_libraries(${_target} PRIVATE ${_lib} muparser::muparser gapscope::warnings)
  add_dependencies(gapscope_wheel_plugins ${_target})
  install(TARGETS ${_target} LIBRARY DESTINATION ${_destination}/${_version}
          COMPONENT wheel EXCLUDE_FROM_ALL OPTIONAL)
endforeach()
set(CMAKE_SKIP_RPATH OFF)
