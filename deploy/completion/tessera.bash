# Completion of Tessera's programs for bash: commands, options, values that have names, and files, from --help.
_tessera() {
  local program=$1 word=$2 previous=$3 command=() given help values=
  for given in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $given == [-=]* || $given == help ]] || command+=("$given")
  done
  # The longest beginning that is a command, or a command of one, such as `keys create`.
  while ! help=$("$program" "${command[@]}" --help 2>/dev/null) && [ ${#command[@]} -gt 0 ]; do
    unset "command[-1]"
  done
  # bash splits --option=value at the sign.
  if [[ $word == = || $previous == = ]]; then
    [[ $word != = ]] || word=
    previous=${COMP_WORDS[COMP_CWORD]}
    [[ $previous == = ]] && previous=${COMP_WORDS[COMP_CWORD - 1]} || previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  if [[ $previous == --* ]]; then
    values=$(sed -n "s/^  \(-[^ ]*,\)\{0,1\}${previous}[ ,][^{]*{\([^}]*\)}.*/\2/p" <<<"$help" | tr ',' '\n' | sed 's/->.*//')
  fi
  if [ -n "$values" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$values" -- "$word")
    return
  fi
  local options commands
  options=$(sed -n 's/^  \(-[^ ]*\).*/\1/p' <<<"$help" | tr ',' '\n' | sed 's/[={].*//')
  commands=$(sed -n '/^Options:/,/^Examples\{0,1\}:/s/^  \([a-z]\{1,\}\) .*/\1/p' <<<"$help")
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")
  elif [ -n "$commands" ]; then
    mapfile -t COMPREPLY < <(compgen -W "help $commands" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}
complete -o filenames -F _tessera \
  tessera tessera-coordinator tessera-gateway tessera-ros tessera-sector-server tessera-viewer
