# GAPSCOPE_SANITIZE: empty, "address,undefined" or "thread" (see CMakePresets.json). Four checks take a fifth of the
# compiler's time and are left out of the first: the address sanitizer traps what is null, and scripts/fuzz asks for
# all of them.
set(GAPSCOPE_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them")
set(GAPSCOPE_SANITIZE_NOT "" CACHE STRING "Checks of these that are left out, as -fno-sanitize= takes them")
if(GAPSCOPE_SANITIZE)
  add_compile_options(-fsanitize=${GAPSCOPE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${GAPSCOPE_SANITIZE})
  if(GAPSCOPE_SANITIZE_NOT)
    add_compile_options(-fno-sanitize=${GAPSCOPE_SANITIZE_NOT})
  endif()
endif()
