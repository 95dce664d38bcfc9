#!/usr/bin/env bash
# deploy/package.sh: builds the Debian packages tessera, libtessera-dev and python3-tessera, and prints their paths.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$top/build/release
"$top/deploy/install_dependencies.sh" package
"$top/deploy/build.sh" release tessera tessera-coordinator tessera-experiments tessera-gateway \
  tessera-sector-server tessera-viewer tessera-ros tessera_c tessera-engine-f64 tessera-python
rm -rf "$build/man" "$build/python_package"
/usr/bin/python3 "$top/deploy/manual_pages.py" "$build/man/man1" \
  "$build"/bin/tessera{,-coordinator,-gateway,-ros,-sector-server,-viewer}
gzip -n9 "$build"/man/man1/*
TESSERA_COMPILED=$build/bin /usr/bin/python3 -m pip install --quiet --no-index --no-build-isolation --no-deps \
  --no-compile --target "$build/python_package" "$top/client_sdk/python" 2>"$build/package.log" || {
  tail -30 "$build/package.log" >&2
  exit 1
}
rm -f "$build"/python_package/*.dist-info/direct_url.json  # of this machine
rm -f "$build"/package/*.deb
cpack --config "$build/CPackConfig.cmake" -B "$build/package" >"$build/package.log" 2>&1 || {
  tail -30 "$build/package.log" >&2
  exit 1
}
ls "$build"/package/*.deb
