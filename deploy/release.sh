#!/usr/bin/env bash
# deploy/release.sh [FOLDER]: makes all that a release publishes from the commit that is checked out, in one folder, by
# default build/publish:
#
#   tessera-VERSION.tar.gz                         the source
#   tessera_*, libtessera-dev_*, python3-tessera_*.deb   packages for Debian 12
#   tessera-VERSION-*.whl                          the Python package, with its compiled parts
#   tessera-VERSION-image.tar.gz                   the container image, where podman or docker can build it
#   SHA256SUMS                                     checksums: sha256sum -c SHA256SUMS
#
# All dates in them are that of the commit, so that the same commit, built again in the same folder with the same packages,
# gives the same archive, packages and wheel. Images have dates of their own.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$top/build/release
folder=${1:-$top/build/publish}
say() { printf '%s\n' "$*" >&2; }

cd "$top"
changes=$(git status --porcelain)
if [ -n "$changes" ]; then
  say "these files differ from the commit, and a release is made of a commit:" "$changes"
  exit 1
fi
if [ $# -eq 0 ]; then
  rm -rf "$folder"
elif [ -e "$folder" ] && [ -n "$(ls -A "$folder")" ]; then
  say "FOLDER = $folder must be empty, or not exist"
  exit 1
fi
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
version=$(sed -n 's/^project(tessera VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
for file in client_sdk/python/pyproject.toml viewer/page/package.json; do
  grep -Eq "^ *\"?version\"?( =|:) \"$version\"" "$file" || {
    say "$file has another version than CMakeLists.txt, which has $version"
    exit 1
  }
done
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

git archive --format=tar --prefix="tessera-$version/" HEAD | gzip -n9 >"$folder/tessera-$version.tar.gz"

deploy/package.sh >/dev/null
cp "$build"/package/*.deb "$folder/"

compiled=$(mktemp -d)
trap 'rm -rf "$compiled"' EXIT
cp "$build"/bin/_native.*.so "$build"/bin/libtessera-{engine-f32,engine-f64,mjcf,wasm}.so "$compiled/"
strip --strip-unneeded "$compiled"/*.so
(cd client_sdk/python && TESSERA_COMPILED=$compiled /usr/bin/python3 -m hatchling build -t wheel -d "$folder" >"$build/package.log" 2>&1) || {
  tail -30 "$build/package.log" >&2
  exit 1
}
chmod 644 "$folder"/*.whl  # hatchling writes wheels through a private temporary file

tool=
for known in podman docker; do
  [ -z "$tool" ] && command -v "$known" >/dev/null && "$known" info >/dev/null 2>&1 && tool=$known
done
if [ -n "$tool" ]; then
  say "building the image with $tool, which builds Tessera once more ..."
  mkdir "$compiled/source"
  tar -xzf "$folder/tessera-$version.tar.gz" -C "$compiled/source" --strip-components=1
  "$tool" build -t "tessera:$version" -f "$compiled/source/deploy/Containerfile" "$compiled/source" >"$build/image.log" 2>&1 || {
    tail -30 "$build/image.log" >&2
    exit 1
  }
  "$tool" save "tessera:$version" | gzip -n >"$folder/tessera-$version-image.tar.gz"
else
  say "without the image: neither podman nor docker can build one here"
fi

(cd "$folder" && sha256sum -- * >SHA256SUMS)
ls -d "$folder"/*
