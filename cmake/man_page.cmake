# cmake -DPROGRAM=... -DOUTPUT=... -DVERSION=... -P man_page.cmake: a manual page from the program's --help
# and that of each command, those below others too.
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

# The commands that a help lists, each after the words `above`: "design chirp".
function(commands_of out text above)
  string(REGEX MATCH "Subcommands:\n(  [a-z][^\n]*\n)+" list "${text}")
  string(REPLACE ";" "," list "${list}")
  string(REGEX MATCHALL "\n  [a-z-]+" found "${list}")
  list(TRANSFORM found STRIP)
  list(TRANSFORM found PREPEND "${above}")
  set(${out} ${found} PARENT_SCOPE)
endfunction()

help(top)
verbatim(body "${top}")
# One text, not a list: a list would lose the semicolons.
string(CONCAT page ".TH GAPSCOPE 1 \"\" \"gapscope ${VERSION}\" \"User Commands\"\n.SH NAME\n"
  "gapscope \\- finds why a simulated mechanism does not move like the real one\n.SH SYNOPSIS\n"
  ".B gapscope\n.I COMMAND\n[\\fIOPTIONS\\fR] ...\n.SH DESCRIPTION\n${body}")
commands_of(commands "${top}" "")
while(commands)
  list(POP_FRONT commands command)
  string(REPLACE " " ";" words "${command}")
  help(text ${words})
  verbatim(body "${text}")
  string(TOUPPER ${command} title)
  string(APPEND page ".SH ${title}\n${body}")
  commands_of(below "${text}" "${command} ")
  list(PREPEND commands ${below})
endwhile()
file(WRITE ${OUTPUT} "${page}")
