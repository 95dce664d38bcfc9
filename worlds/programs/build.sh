#!/usr/bin/env bash
# worlds/programs/build.sh [FOLDER]: compiles the programs here to WebAssembly, in FOLDER (default: here). Needs
# clang-14 and lld-14; the modules here were made by those of Debian 12, so that all worlds have the same ones.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
for source in "$here"/*.c; do
  module=${1:-$here}/$(basename "$source" .c).wasm
  clang-14 --target=wasm32 -O2 -Wall -Wextra -Werror -nostdlib -Wl,--no-entry,--strip-all \
    -I"$here/../../client_sdk/include" -o "$module" "$source"
  chmod -x "$module"
done
