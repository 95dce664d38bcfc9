#!/usr/bin/env bash
# worlds/programs/build.sh [FOLDER]: compiles the programs here, and shy.c of client_sdk/programs/template, to WebAssembly,
# in FOLDER (default: beside each). Needs clang-14 and lld-14; the modules there were made by those of Debian 12, so that all
# worlds have the same ones.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
sdk=$here/../../client_sdk
for source in "$here/flee.c" "$here/balance.c" "$sdk/programs/template/shy.c"; do
  module=${1:-$(dirname "$source")}/$(basename "$source" .c).wasm
  clang-14 --target=wasm32 -O2 -Wall -Wextra -Werror -nostdlib -Wl,--no-entry,--strip-all \
    -I"$sdk/include" -o "$module" "$source"
  chmod -x "$module"
done
