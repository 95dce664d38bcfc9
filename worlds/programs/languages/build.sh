#!/usr/bin/env bash
# worlds/programs/languages/build.sh [FOLDER]: compiles flee.ts and flee.rs to WebAssembly, in FOLDER (default: here).
# Needs AssemblyScript (`npm install assemblyscript`; ASC: its compiler) and Debian's rustc with
# libstd-rust-dev-wasm32. The modules here were made with AssemblyScript 0.28.20 and rustc 1.63. Tessera does not need
# them; golden_hashes_test compares them with flee.c.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
to=$(cd "${1:-$here}" && pwd)
cd "$here"
"${ASC:-asc}" flee.ts -o "$to/flee_ts.wasm" -O3 --runtime stub --use abort= \
  --transform ../../../client_sdk/programs/assemblyscript/describe.mjs
"${RUSTC:-rustc}" --target wasm32-unknown-unknown --crate-type cdylib -O -C panic=abort -C strip=symbols \
  -C link-arg=-zstack-size=16384 -o "$to/flee_rs.wasm" flee.rs
