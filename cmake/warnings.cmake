# One place for compile flags: every target of ours links gapscope::warnings.
add_library(gapscope_warnings INTERFACE)
add_library(gapscope::warnings ALIAS gapscope_warnings)
target_compile_options(gapscope_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                       -Werror=return-type -Wno-missing-field-initializers)
# GCC 12 sees overlapping copies where a literal and a std::string are joined: its bug 105651, mended in 13.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(gapscope_warnings INTERFACE -Wno-restrict)
endif()
# The same input must give the same bytes on every build: no fused or reassociated arithmetic.
target_compile_options(gapscope_warnings INTERFACE -ffp-contract=off)
