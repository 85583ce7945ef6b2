# One place for compile flags: every target of ours links gapscope::warnings.
add_library(gapscope_warnings INTERFACE)
add_library(gapscope::warnings ALIAS gapscope_warnings)
target_compile_options(gapscope_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                       -Werror=return-type -Wno-missing-field-initializers)
# The same input must give the same bytes on every build: no fused or reassociated arithmetic.
target_compile_options(gapscope_warnings INTERFACE -ffp-contract=off)
