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

# Those that begin with a dash, if there are any: others may be the values of these.
refuse_unknown() {
  local word named=()
  for word in "$@"; do [[ $word != -* ]] || named+=("$word"); done
  [ ${#named[@]} -gt 0 ] || named=("$@")
  if [ ${#named[@]} -gt 1 ]; then refuse 2 "The following arguments were not expected: ${named[*]}"; fi
  refuse 2 "The following argument was not expected: ${named[0]}"
}

# The kinds of the values of options, empty for those without one.
read_help() {
  local line name
  while IFS= read -r line; do
    [[ $line =~ ^\ \ (-[^\ ]+)(\ (TEXT|INT|UINT|FLOAT))? ]] || continue
    for name in ${BASH_REMATCH[1]//,/ }; do
      kinds[$name]=${BASH_REMATCH[3]}
    done
    [[ ! $line =~ ^\ \ --prove\ Excludes:(.*) ]] || excluded=" ${BASH_REMATCH[1]} "
  done <"$help_file"
}

# Sets `world` and `options`. Exits with 2, or 1 for a world that cannot be read, and a message; with 0 after --help.
take_arguments() {
  local -A kinds=()
  local excluded="" unknown=() given name value
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
