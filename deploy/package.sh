#!/usr/bin/env bash
# deploy/package.sh: builds the Debian packages tessera and libtessera-dev, and prints their paths.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$top/build/release
"$top/deploy/build.sh" release tessera tessera-coordinator tessera-experiments tessera-gateway \
  tessera-sector-server tessera-viewer tessera-ros tessera_c tessera-engine-f64
rm -f "$build"/package/*.deb
cpack --config "$build/CPackConfig.cmake" -B "$build/package" >"$build/package.log" 2>&1 || {
  tail -30 "$build/package.log" >&2
  exit 1
}
ls "$build"/package/*.deb
