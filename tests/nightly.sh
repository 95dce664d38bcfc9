#!/usr/bin/env bash
# tests/nightly.sh [PART]...: what takes too long for ./test, as root, on a bare Debian 12 with nothing else running. Without
# arguments, all parts, in this order:
#
#   run        ./run
#   test       ./test
#   pages      what the pages tell readers to install and build
#   package    the packages in a bare root: installed, used, removed
#   seeds      a thousand simulated clusters with faults and extremes, other ones each time
#   chaos      ten minutes of real processes that are killed, stopped and cut off from each other
#   machines   other compilers, arm64, and a cluster of amd64 and arm64
#
# Prints a line for each part with its minutes; the output of each is in build/nightly/PART.log. Ends with 1 if one fails.
set -uo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$top" || exit 1
bin=build/release/bin
logs=build/nightly

all=(run test pages package seeds chaos machines)

# shellcheck disable=SC2317  # the parts, called by their names
part_run() { ./run; }
part_test() { ./test; }
part_pages() { tests/set_up_check.py; }
part_package() { deploy/package.sh && deploy/try_package.sh; }
part_seeds() {
  local first
  first=$(date +%s)
  "$bin/tessera" simulate worlds/voyage.sdf --seed "$first" --seeds 500 --servers 3 --commands 40 --crashes 2 --cuts 2 --stops 1 \
    --coordinator-crashes 1 --drains 1 &&
    "$bin/tessera" simulate worlds/rover.sdf --seed "$first" --seeds 500 --servers 2 --commands 40 --extremes
}
part_chaos() { TESSERA_MINUTES=10 TESSERA_SEED=$(date +%s) "$bin/chaos_drill"; }
part_machines() { tests/other_machines.sh; }

parts=("$@")
[ ${#parts[@]} -gt 0 ] || parts=("${all[@]}")
for part in "${parts[@]}"; do
  [[ " ${all[*]} " == *" $part "* ]] || { sed -n '2,13s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
done
mkdir -p "$logs"
failed=0
for part in "${parts[@]}"; do
  started=$SECONDS outcome=passed
  "part_$part" >"$logs/$part.log" 2>&1 || outcome=FAILED failed=1
  printf '%-9s %s after %d min\n' "$part" "$outcome" $(((SECONDS - started + 30) / 60))
done
exit $failed
