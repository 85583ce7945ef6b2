# bash completion for gapscope. Asks the program itself, so it never falls behind it.
_gapscope() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]} help
  if ((COMP_CWORD == 1)); then
    help=$("$program" --help 2>/dev/null)
    local commands
    commands=$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\).*/\1/p' <<<"$help")
    mapfile -t COMPREPLY < <(compgen -W "$commands --help --version" -- "$current")
    return
  fi
  help=$("$program" "${COMP_WORDS[1]}" --help 2>/dev/null) || return
  # An option that takes one of a set: "--mode {free_run,windows}".
  local choices
  choices=$(sed -n "s/^  ${previous} [A-Z:]*{\([^}]*\)}.*/\1/p" <<<"$help")
  if [ -n "$choices" ]; then
    mapfile -t COMPREPLY < <(compgen -W "${choices//,/ }" -- "$current")
  elif [[ $current == -* ]]; then
    local options
    options=$(grep -oE '^  (-h,)?--[a-z-]+' <<<"$help" | grep -oE -- '--[a-z-]+')
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
  else
    compopt -o default  # files
  fi
}
complete -F _gapscope gapscope
