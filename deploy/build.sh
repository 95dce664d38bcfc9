#!/usr/bin/env bash
# deploy/build.sh PRESET [TARGET]...: installs missing packages, configures and builds. Prints output only on failure, and how
# long it took if that was more than some seconds.
# Without targets: everything, including tests. With targets, installs and configures only what they need; an existing
# build folder keeps what it was configured for.
#
#   deploy/build.sh release tessera-viewer     the web UI
#   deploy/build.sh release tessera-wasm       the engine of programs in WebAssembly
#   deploy/build.sh release tessera-python     the compiled part of the Python package, which pip then installs
#   deploy/build.sh release reference          the API reference, as pages in build/release/reference
#   deploy/build.sh release tessera tessera-mjcf   the command, with the reader of worlds and robots of MuJoCo
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/progress.sh
. "$top/deploy/progress.sh"
preset=$1
shift
build=$top/build/$preset
log=$build/build.log
mkdir -p "$build"

has() { grep -qs "^TESSERA_$1:BOOL=ON" "$build/CMakeCache.txt"; }
group=run options=()
if [ $# -eq 0 ] || has TESTS; then
  group=test options=(-DTESSERA_TESTS=ON -DTESSERA_VIEWER=ON)
elif [[ " $* " == *" tessera-viewer "* ]] || has VIEWER; then
  group=web options=(-DTESSERA_TESTS=OFF -DTESSERA_VIEWER=ON)
else
  options=(-DTESSERA_TESTS=OFF -DTESSERA_VIEWER=OFF)
fi
"$top/deploy/install_dependencies.sh" "$group"
# What has a target once its packages are there.
later=()
for target in tessera-wasm tessera-mjcf tessera-python reference; do
  [[ " $* " == *" $target "* ]] || continue
  later+=("$target")
  "$top/deploy/install_dependencies.sh" "${target#tessera-}"
done
started=$SECONDS

configured() {
  local option target
  [ -f "$build/build.ninja" ] || return 1
  for target in "${later[@]}"; do grep -q "^build $target:" "$build/build.ninja" || return 1; done
  for option in "${options[@]}"; do grep -qxF -- "${option#-D}" <(sed 's/:BOOL=/=/' "$build/CMakeCache.txt") || return 1; done
}
cd "$top"
if ! configured; then
  echo "configuring in $build ..." >&2
  cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
fi
if [ ! -e "$build/.ninja_log" ]; then
  echo "building: $(ninja -C "$build" -t commands "$@" | wc -l) steps on $(nproc) processors, which takes minutes" >&2
fi
ninja -C "$build" "$@" 2>&1 | tee "$log" | progress "building" || {
  grep -v '^\[' "$log" | tail -100 >&2
  exit 1
}
took=$((SECONDS - started))
[ "$took" -lt 5 ] || echo "built in $took s" >&2
