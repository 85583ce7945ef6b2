# cmake -DPROGRAM=... -DOUTPUT=... -DVERSION=... -P man_page.cmake: a manual page from the program's --help
# and that of each subcommand.
function(help out)
  execute_process(COMMAND ${PROGRAM} ${ARGN} --help OUTPUT_VARIABLE text RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${PROGRAM} ${ARGN} --help: exit status ${status}")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

# Verbatim in roff: backslashes, and dots or quotes that begin a line.
function(verbatim out text)
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(REGEX REPLACE "\n([.'])" "\n\\\\&\\1" text "${text}")
  set(${out} ".nf\n${text}.fi\n" PARENT_SCOPE)
endfunction()

help(top)
string(REGEX MATCH "Subcommands:\n(  [a-z][^\n]*\n)+" list "${top}")
string(REGEX MATCHALL "\n  [a-z]+" commands "${list}")
verbatim(body "${top}")
set(page ".TH GAPSCOPE 1 \"\" \"gapscope ${VERSION}\" \"User Commands\"\n.SH NAME\n"
  "gapscope \\- finds why a simulated mechanism does not move like the real one\n.SH SYNOPSIS\n"
  ".B gapscope\n.I COMMAND\n[\\fIOPTIONS\\fR] ...\n.SH DESCRIPTION\n${body}")
foreach(command ${commands})
  string(STRIP "${command}" command)
  help(text ${command})
  verbatim(body "${text}")
  string(TOUPPER ${command} title)
  list(APPEND page ".SH ${title}\n${body}")
endforeach()
list(JOIN page "" page)
file(WRITE ${OUTPUT} "${page}")
