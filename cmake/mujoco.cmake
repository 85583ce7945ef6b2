# Defines mujoco::mujoco.
#   GAPSCOPE_MUJOCO=wheel   the pinned PyPI wheel that scripts/setup fetched, unpacked into the build folder (default)
#   GAPSCOPE_MUJOCO=system  the user's own MuJoCo (>= 3.14) through find_package
set(GAPSCOPE_MUJOCO "wheel" CACHE STRING "wheel or system")
set_property(CACHE GAPSCOPE_MUJOCO PROPERTY STRINGS wheel system)
set(GAPSCOPE_MUJOCO_VERSION 4.0.1)
set(GAPSCOPE_MUJOCO_SHA256 be28c0c7587347ef996b4de0487264e9da296282082b092bae211a9163e9aed6)

if(GAPSCOPE_MUJOCO STREQUAL "system")
  find_package(mujoco 3.14 REQUIRED)
elseif(GAPSCOPE_MUJOCO STREQUAL "wheel")
  if(DEFINED ENV{GAPSCOPE_CACHE_DIR})
    set(_cache "$ENV{GAPSCOPE_CACHE_DIR}")
  else()
    set(_cache "$ENV{HOME}/.cache/gapscope")
  endif()
  set(GAPSCOPE_CACHE_DIR "${_cache}" CACHE PATH "Where scripts/setup keeps downloads")
  file(GLOB _wheel ${GAPSCOPE_CACHE_DIR}/mujoco_core-${GAPSCOPE_MUJOCO_VERSION}-cp311-*.whl)
  if(NOT _wheel)
    message(FATAL_ERROR "No mujoco_core ${GAPSCOPE_MUJOCO_VERSION} wheel in ${GAPSCOPE_CACHE_DIR}. "
                        "Run scripts/setup, or configure with -DGAPSCOPE_MUJOCO=system.")
  endif()
  list(GET _wheel 0 _wheel)
  set(_sdk ${CMAKE_BINARY_DIR}/mujoco-${GAPSCOPE_MUJOCO_VERSION})
  if(NOT EXISTS ${_sdk}/mujoco/include/mujoco/mujoco.h)
    file(SHA256 ${_wheel} _hash)
    if(NOT _hash STREQUAL GAPSCOPE_MUJOCO_SHA256)
      message(FATAL_ERROR "${_wheel} has sha256 ${_hash}, expected ${GAPSCOPE_MUJOCO_SHA256}. "
                          "Delete it and run scripts/setup.")
    endif()
    file(ARCHIVE_EXTRACT INPUT ${_wheel} DESTINATION ${_sdk}
         PATTERNS "mujoco/include/*" "mujoco/libmujoco.so.*" "*LICENSE*")
  endif()
  file(GLOB _lib ${_sdk}/mujoco/libmujoco.so.*)
  get_filename_component(_soname ${_lib} NAME)
  add_library(mujoco::mujoco SHARED IMPORTED GLOBAL)
  set_target_properties(mujoco::mujoco PROPERTIES
    IMPORTED_LOCATION ${_lib} IMPORTED_SONAME ${_soname}
    INTERFACE_INCLUDE_DIRECTORIES ${_sdk}/mujoco/include)
  set(GAPSCOPE_MUJOCO_LIBRARY ${_lib})
else()
  message(FATAL_ERROR "GAPSCOPE_MUJOCO is '${GAPSCOPE_MUJOCO}', allowed: wheel, system")
endif()
