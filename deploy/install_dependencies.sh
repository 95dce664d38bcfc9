#!/usr/bin/env bash
# Installs what Tessera is built from and with, on Debian 12 (bookworm): only what is missing, nothing if all is
# there. Asks for root by sudo where it is needed.
set -euo pipefail

packages=(
  # to build
  build-essential ccache cmake mold ninja-build pkg-config
  cyclonedds-tools file protobuf-compiler protobuf-compiler-grpc
  # the physics, the network, the files
  libbullet-dev cyclonedds-dev libgrpc++-dev libprotobuf-dev
  libsdformat-dev libtinyxml2-dev libconsole-bridge-dev libassimp-dev libgeographiclib-dev
  # what the code stands on
  libabsl-dev libcli11-dev libeigen3-dev libspdlog-dev libtbb-dev libxxhash-dev nlohmann-json3-dev
  prometheus-cpp-dev
  # the page
  libcivetweb-dev
  # to test
  chromium libgmock-dev libgtest-dev libyaml-cpp-dev
  # the Python client
  mypy python3-grpcio python3-hatchling python3-numpy python3-pip python3-protobuf python3-pytest python3-venv
  python3-zstandard
)
# A Node.js of another origin brings npm along, and the distribution's would not go with it.
command -v node >/dev/null && command -v npm >/dev/null || packages+=(nodejs npm)

missing=()
for package in "${packages[@]}"; do
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
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
install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >"$log" 2>&1
}
# Package lists may be absent or old: fetched only where the first try fails.
install || { "${as_root[@]}" apt-get update -qq >"$log" 2>&1 && install; } || {
  tail -20 "$log" >&2
  exit 1
}
