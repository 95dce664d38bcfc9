#!/usr/bin/env bash
# deploy/build.sh PRESET [TARGET]...: configures and builds, quietly while all goes well.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=$1
shift
build=$top/build/$preset
mkdir -p "$build"
log=$build/build.log

cd "$top"
if [ ! -f "$build/build.ninja" ]; then
  echo "configuring and building in $build (the first time takes some minutes) ..." >&2
  cmake --preset "$preset" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
fi
# Ninja's own status line is the progress bar; warnings and errors are shown whole.
if [ -t 2 ]; then
  NINJA_STATUS='[%f/%t, %w] ' ninja -C "$build" "$@" >&2 || exit 1
else
  ninja -C "$build" "$@" >"$log" 2>&1 || { grep -v '^\[' "$log" | tail -100 >&2; exit 1; }
fi
