#!/usr/bin/env bash
# deploy/install_dependencies.sh [run|wasm|mjcf|python|reference|web|package|test]: installs the missing packages that
# Tessera needs on Debian 12 (bookworm), and nothing else. Uses sudo if it does not run as root. Each group includes `run`,
# which is the default:
#
#   run         to build and run worlds
#   wasm        for programs in WebAssembly: their engine
#   mjcf        for worlds and robots of MuJoCo
#   python      for simulations in Python, and its package
#   reference   for the pages of the API reference
#   web         for the web UI: Node.js and npm
#   package     for the Debian packages
#   test        for the tests: test libraries, Python, a browser, the formatter
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/progress.sh
. "$top/deploy/progress.sh"

packages=(
  # build tools
  cmake cyclonedds-tools g++ mold ninja-build pkgconf protobuf-compiler protobuf-compiler-grpc
  # physics, network, world files
  libbullet-dev cyclonedds-dev libgrpc++-dev libprotobuf-dev
  libsdformat-dev libtinyxml2-dev libconsole-bridge-dev libassimp-dev libbullet-extras-dev libpng-dev libtiff-dev
  # general libraries
  libabsl-dev libcli11-dev libcivetweb-dev libeigen3-dev libmetis-dev libsleef-dev libspdlog-dev libssl-dev libtbb-dev libxxhash-dev
  libyaml-cpp-dev nlohmann-json3-dev prometheus-cpp-dev
)
web_packages=()
# A Node.js from elsewhere includes npm, and the distribution's npm would not match it.
command -v node >/dev/null && command -v npm >/dev/null || web_packages+=(nodejs npm)
wasm_packages=(libmozjs-102-dev)
python_packages=(
  pybind11-dev python3-dev python3-grpcio python3-hatchling python3-numpy python3-pip python3-protobuf python3-venv
)
package_packages=(dpkg-dev file)
mjcf_packages=(libmujoco-dev)
reference_packages=(doxygen)
test_packages=(
  ccache clang-format-14 clang-tidy-16 etcd-server file libgeographiclib-dev libgmock-dev libgtest-dev valgrind
  # manual pages
  groff-base
  # what makes and compares programs in WebAssembly
  clang-14 lld-14 wabt
  # the Python package
  mypy python3-pytest python3-zstandard
  # tutorials
  procps python3-matplotlib
  # the web UI
  chromium
)
case ${1:-run} in
  run) ;;
  wasm) packages+=("${wasm_packages[@]}") ;;
  mjcf) packages+=("${mjcf_packages[@]}") ;;
  python) packages+=("${python_packages[@]}") ;;
  reference) packages+=("${python_packages[@]}" "${reference_packages[@]}") ;;
  web) packages+=("${web_packages[@]}") ;;
  package) packages+=("${wasm_packages[@]}" "${mjcf_packages[@]}" "${python_packages[@]}" "${web_packages[@]}" "${package_packages[@]}") ;;
  test) packages+=("${wasm_packages[@]}" "${mjcf_packages[@]}" "${python_packages[@]}" "${web_packages[@]}" "${test_packages[@]}") ;;
  *)
    sed -n '2,13s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2
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
    echo "neither root nor sudo is available; install them with: apt-get install --no-install-recommends" >&2
    exit 1
  }
  as_root=(sudo)
fi

# What apt would fetch; nothing where package lists are missing or outdated.
megabytes=$(LC_ALL=C apt-get install --print-uris -qq -y --no-install-recommends "${missing[@]}" 2>/dev/null |
  awk '{ sum += $3 } END { if (sum) printf "%.0f MB of ", sum / 1e6 }') || true
echo "installing ${megabytes}packages: ${missing[*]}" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Progress out of 1000: a third for downloads, the rest for unpacking and configuration. Reads apt's status lines,
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
# apt's status has its own descriptor: the output of packages goes to the log, so nothing here can make them fail.
# A root shell opens it, since sudo passes on only the first three descriptors.
install() {
  "${as_root[@]}" sh -c 'exec 3>&1 >"$0" 2>&1
    DEBIAN_FRONTEND=noninteractive exec apt-get install -y -qq --no-install-recommends -o APT::Status-Fd=3 "$@"' \
    "$log" "${missing[@]}" | shares | progress "installing"
}
# Package lists may be missing or outdated: they are updated only if the first attempt fails.
install || { "${as_root[@]}" apt-get update -qq >"$log" 2>&1 && install; } || {
  tail -20 "$log" >&2
  exit 1
}
