# gapscope_catalogue(FOLDER TYPE PREFIX MAKER): every file NAME.cc of FOLDER defines `TYPE PREFIX_NAME()`. Lists the
# files in FOLDER_sources, and writes FOLDER_table.inc, whose function MAKER gives a vector of all.
function(gapscope_catalogue folder type prefix maker)
  file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} ${folder}/*.cc)
  set(declarations "")
  set(calls "")
  foreach(source ${sources})
    get_filename_component(name ${source} NAME_WE)
    string(APPEND declarations "${type} ${prefix}_${name}();\n")
    string(APPEND calls "${prefix}_${name}(), ")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${folder}_table.inc
       CONTENT "${declarations}static std::vector<${type}> ${maker}() { return {${calls}}; }\n")
  set(${folder}_sources ${sources} PARENT_SCOPE)
endfunction()
