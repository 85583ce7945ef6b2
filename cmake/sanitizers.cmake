# GAPSCOPE_SANITIZE: empty, "address,undefined" or "thread" (see CMakePresets.json).
set(GAPSCOPE_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them")
if(GAPSCOPE_SANITIZE)
  add_compile_options(-fsanitize=${GAPSCOPE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${GAPSCOPE_SANITIZE})
endif()
