# shellcheck shell=bash
# Checks the arguments of ./run as far as that goes without a build. To be sourced, with $top set.
#
# deploy/run_help.txt is what `tessera run --help` prints (deploy_test compares them).

help_file=${top:?}/deploy/run_help.txt

# Ends ./run with an exit code and a message.
refuse() {
  echo "$2" >&2
  [ "$1" = 1 ] || echo "Usage: ./run [WORLD] [OPTION]... (./run --help lists the options)" >&2
  exit "$1"
}

# How many letters must change in one word to get the other.
distance() {
  local i j diagonal changed above row=()
  for ((j = 0; j <= ${#2}; ++j)); do row[j]=$j; done
  for ((i = 1; i <= ${#1}; ++i)); do
    diagonal=${row[0]} row[0]=$i
    for ((j = 1; j <= ${#2}; ++j)); do
      above=${row[j]} changed=$diagonal diagonal=${row[j]}
      [ "${1:i-1:1}" = "${2:j-1:1}" ] || ((++changed))
      if ((above + 1 < changed)); then changed=$((above + 1)); fi
      if ((row[j - 1] + 1 < changed)); then changed=$((row[j - 1] + 1)); fi
      row[j]=$changed
    done
  done
  echo "${row[${#2}]}"
}

# The argument, with the option that it may have been meant to be.
with_guess() {
  local word=${1%%=*} name guess="" letters best
  best=$(((${#word} - 2) / 3 + 2))
  for name in "${names[@]}"; do
    [ ${#word} -le 64 ] || break
    letters=$(distance "$word" "$name")
    if [ "$letters" -lt "$best" ]; then best=$letters guess=" (did you mean $name?)"; fi
  done
  echo "$1$guess"
}

# Those that begin with a dash, if there are any: others may be the values of these.
refuse_unknown() {
  local word named=()
  for word in "$@"; do [[ $word != -* ]] || named+=("$(with_guess "$word")"); done
  [ ${#named[@]} -gt 0 ] || named=("$@")
  if [ ${#named[@]} -gt 1 ]; then refuse 2 "The following arguments were not expected: ${named[*]}"; fi
  refuse 2 "The following argument was not expected: ${named[0]}"
}

# The kinds of the values of options, empty for those without one; and the options in the order of the help.
read_help() {
  local line name
  while IFS= read -r line; do
    [[ $line =~ ^\ \ (-[^\ ]+)(\ (TEXT|INT|UINT|FLOAT))? ]] || continue
    for name in ${BASH_REMATCH[1]//,/ }; do
      kinds[$name]=${BASH_REMATCH[3]}
      names+=("$name")
    done
    [[ ! $line =~ ^\ \ --prove\ Excludes:(.*) ]] || excluded=" ${BASH_REMATCH[1]} "
  done <"$help_file"
}

# Sets `world` and `options`. Exits with 2, or 1 for a world that cannot be read, and a message; with 0 after --help.
take_arguments() {
  local -A kinds=()
  local names=() excluded="" unknown=() given name value
  read_help
  world="" options=()
  while [ $# -gt 0 ]; do
    given=$1 name=${1%%=*} value=${1#"${1%%=*}"}
    shift
    if [[ $given == -h || $given == --help ]]; then
      sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$top/run"
      echo
      cat "$help_file"
      exit 0
    elif [[ $given != -* && -z $world ]]; then
      world=$given
    elif [[ ! -v kinds[$name] ]]; then
      unknown+=("$given")
    else
      [[ $excluded != *" $name "* ]] || refuse 2 "--prove, which ./run adds, excludes $name: use tessera run"
      options+=("$given")
      [[ -n ${kinds[$name]} && ${#value} -le 1 ]] || continue
      [ $# -gt 0 ] || refuse 2 "$name: 1 required ${kinds[$name]} missing"
      options+=("$1")
      shift
    fi
  done
  [ ${#unknown[@]} -eq 0 ] || refuse_unknown "${unknown[@]}"
  [ -n "$world" ] || world=$top/worlds/earth.sdf
  world=$(realpath -m -- "$world")
  [ ! -d "$world" ] || refuse 1 "tessera: $world: it is a folder, not a world file"
  [ -f "$world" ] || refuse 1 "tessera: $world: there is no such file"
  [ -r "$world" ] || refuse 1 "tessera: $world: the file cannot be read"
}
