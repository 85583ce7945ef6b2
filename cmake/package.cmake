# What a .deb says of itself. scripts/package runs cpack with this over the folder that it has put together; it takes
# what the package depends on from the libraries that its programs are linked with.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The gapscope maintainers")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# What `gapscope doctor` looks for and replay, tune and diagnose do without: pictures and videos.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libcairo2, libosmesa6 | libegl1, ffmpeg")
# What find_package(gapscope) looks for.
string(CONCAT CPACK_DEBIAN_PACKAGE_SUGGESTS
  "cmake, libeigen3-dev, libfmt-dev, libmd-dev, libmuparser-dev, libnlopt-cxx-dev, libyaml-cpp-dev, "
  "nlohmann-json3-dev, zlib1g-dev")
include(CPack)
