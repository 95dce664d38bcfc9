#!/usr/bin/env bash
# deploy/install_dependencies.sh [run|web|test]: installs what Tessera is built from and with, on Debian 12 (bookworm):
# only what is missing, nothing if all is there. Asks for root by sudo where it is needed. Each group includes those
# before it:
#
#   run    what building and running worlds takes (the default)
#   web    and the web UI: Node.js bundles its page
#   test   and the tests: test libraries, Python, a browser, the formatter
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/progress.sh
. "$top/deploy/progress.sh"

packages=(
  # to build
  cmake cyclonedds-tools g++ mold ninja-build pkgconf protobuf-compiler protobuf-compiler-grpc
  # the physics, the network, the files
  libbullet-dev cyclonedds-dev libgrpc++-dev libprotobuf-dev
  libsdformat-dev libtinyxml2-dev libconsole-bridge-dev libassimp-dev libgeographiclib-dev
  # what the code stands on
  libabsl-dev libcli11-dev libcivetweb-dev libeigen3-dev libspdlog-dev libtbb-dev libxxhash-dev nlohmann-json3-dev
  prometheus-cpp-dev
)
web_packages=()
# A Node.js of another origin brings npm along, and the distribution's would not go with it.
command -v node >/dev/null && command -v npm >/dev/null || web_packages+=(nodejs npm)
test_packages=(
  ccache clang-format-14 file libgmock-dev libgtest-dev libyaml-cpp-dev
  # the Python client
  mypy python3-grpcio python3-hatchling python3-numpy python3-pip python3-protobuf python3-pytest python3-venv
  python3-zstandard
  # the web UI
  chromium
)
case ${1:-run} in
  run) ;;
  web) packages+=("${web_packages[@]}") ;;
  test) packages+=("${web_packages[@]}" "${test_packages[@]}") ;;
  *)
    sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
    exit 2
    ;;
esac

missing=()
installed=$(dpkg-query -W -f '${binary:Package} ${db:Status-Status}\n' | sed -n 's/\(:[a-z0-9]*\)\? installed$//p')
for package in "${packages[@]}"; do
  grep -qxF -- "$package" <<<"$installed" || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || {
    echo "missing: ${missing[*]}" >&2
    echo "neither root nor sudo: install them with  apt-get install --no-install-recommends" >&2
    exit 1
  }
  as_root=(sudo)
fi

echo "installing ${missing[*]}" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Of a thousand: a third for what is fetched, the rest for what is unpacked and set up. As apt says it:
# "pmstatus:PACKAGE:PERCENT:WHAT" or "dlstatus:...", where PACKAGE may end with ":ARCHITECTURE".
shares() {
  local line
  while IFS= read -r line; do
    [[ $line =~ ^(dl|pm)status:[^:]*(:[a-z][a-z0-9]*)?:([0-9]+) ]] || continue
    if [ "${BASH_REMATCH[1]}" = dl ]; then
      echo "[$((10#${BASH_REMATCH[3]} * 10 / 3))/1000]"
    else
      echo "[$((333 + 10#${BASH_REMATCH[3]} * 20 / 3))/1000]"
    fi
  done
}
# apt's status has a descriptor of its own: what packages print as they are set up goes to the log, so that nothing
# here can fail them. A shell as root opens it, since sudo passes on the first three only.
install() {
  "${as_root[@]}" sh -c 'exec 3>&1 >"$0" 2>&1
    DEBIAN_FRONTEND=noninteractive exec apt-get install -y -qq --no-install-recommends -o APT::Status-Fd=3 "$@"' \
    "$log" "${missing[@]}" | shares | progress "installing"
}
# Package lists may be absent or old: fetched only where the first try fails.
install || { "${as_root[@]}" apt-get update -qq >"$log" 2>&1 && install; } || {
  tail -20 "$log" >&2
  exit 1
}
