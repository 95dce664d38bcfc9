# Completion of `tessera` for bash: commands, options and files, from the help of the program itself.
_tessera() {
  local word=${COMP_WORDS[COMP_CWORD]} command=() given help
  for given in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $given == -* || $given == help ]] || command+=("$given")
  done
  # The longest beginning that is a command, or a command of one, such as `keys create`.
  while ! help=$(tessera "${command[@]}" --help 2>/dev/null) && [ ${#command[@]} -gt 0 ]; do
    unset "command[-1]"
  done
  local options commands
  options=$(sed -n 's/^  \(-[^ ]*\).*/\1/p' <<<"$help" | tr ',' '\n' | sed 's/=.*//')
  commands=$(sed -n '/^Options:/,/^Examples\{0,1\}:/s/^  \([a-z]\{1,\}\) .*/\1/p' <<<"$help")
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")
  elif [ -n "$commands" ]; then
    mapfile -t COMPREPLY < <(compgen -W "help $commands" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}
complete -o filenames -F _tessera tessera
