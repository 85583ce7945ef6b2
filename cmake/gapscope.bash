# bash completion for gapscope. Asks the program itself, so it never falls behind it.
_gapscope() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]}
  local help commands choices options word path=()
  # The help of the command that the words before name: "design", then "chirp".
  help=$("$program" --help 2>/dev/null) || return
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}" ""; do
    commands=$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p' <<<"$help")
    grep -qxF -e "$word" <<<"$commands" && [ -n "$word" ] || break
    path+=("$word")
    help=$("$program" "${path[@]}" --help 2>/dev/null) || return
  done
  # An option that takes one of a set: "--mode {free_run,windows}".
  choices=$(sed -n "s/^  ${previous} [A-Z:]*{\([^}]*\)}.*/\1/p" <<<"$help")
  if [ -n "$choices" ]; then
    mapfile -t COMPREPLY < <(compgen -W "${choices//,/ }" -- "$current")
  elif [[ $current == -* || -n $commands ]]; then
    options=$(grep -oE '^  (-h,)?--[a-z0-9-]+' <<<"$help" | grep -oE -- '--[a-z0-9-]+')
    mapfile -t COMPREPLY < <(compgen -W "$commands $options" -- "$current")
  else
    compopt -o default  # files
  fi
}
complete -F _gapscope gapscope
