#!/usr/bin/env bash
# tests/other_machines.sh [MACHINE]...: the golden hashes by other compilers and on arm64, from nothing, on Debian 12 on amd64.
# Installs what is missing, builds the test of the golden hashes and unit tests of the arithmetic in build/MACHINE, runs them,
# and prints a table. Without arguments: all machines.
#
#   gcc-12    what releases are built with
#   clang-16, clang-19
#   arm64     cross-compiled by GCC 12, run by qemu; the root with the libraries for arm64 is build/arm64-root
#   mixed     a cluster of a server for amd64 and one for arm64, each of which is lost once (tests/mixed_cluster.py)
#
# JOBS (default: the number of processors) is how many compilers run at once. Ends with 1 if a machine has other bits.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$top"
jobs=${JOBS:-$(nproc)}
all=(gcc-12 clang-16 clang-19 arm64 mixed)
# The tests of what the bits are computed with.
units=(base_test solver_test joint_numbers_test islands_test collision_test)
export TESSERA_ARM64_ROOT=${TESSERA_ARM64_ROOT:-$top/build/arm64-root}

[ "$(id -u)" -eq 0 ] && as_root=() || as_root=(sudo)
install() { DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "$@" >/dev/null; }

# The libraries that Tessera needs, for arm64: unpacked, not installed, so nothing in the root has to run.
make_arm64_root() {
  local root=$TESSERA_ARM64_ROOT packages
  [ ! -e "$root/complete" ] || return 0
  packages=(
    libabsl-dev libassimp-dev libbullet-dev libbullet-extras-dev libc6-dev libcivetweb-dev libcli11-dev libconsole-bridge-dev
    libeigen3-dev cyclonedds-dev libgeographiclib-dev libgmock-dev libgrpc++-dev libgtest-dev libmetis-dev libmozjs-102-dev
    libmujoco-dev libpng-dev libprotobuf-dev libsdformat-dev libsleef-dev libspdlog-dev libssl-dev libstdc++-12-dev libtbb-dev
    libtiff-dev libtinyxml2-dev libxxhash-dev libyaml-cpp-dev nlohmann-json3-dev prometheus-cpp-dev pybind11-dev python3-dev
    wabt zlib1g-dev
  )
  rm -rf "$root"
  mmdebstrap --variant=extract --architectures=arm64 --mode=root --include="$(IFS=,; echo "${packages[*]}")" bookworm "$root"
  # Absolute links and paths would lead out of the root.
  local link target
  while read -r link; do
    target=$root$(readlink "$link")
    ln -sfn "$(realpath -m --relative-to="$(dirname "$link")" "$target")" "$link"
  done < <(find "$root" -xtype l -lname '/*')
  grep -rlE '[";:]/usr/(lib/aarch64-linux-gnu/lib|include)' "$root/usr/lib/aarch64-linux-gnu/cmake" |
    xargs sed -i -E "s#([\";:])(/usr/(lib/aarch64-linux-gnu/lib|include))#\1$root\2#g"
  rebuild_bullet
  touch "$root/complete"
}

# Debian's Bullet for arm64 is compiled with fused multiply-add, which amd64 does not have: its hulls, its sweeps and its solver
# would have other bits. Compiles the same source without.
rebuild_bullet() {
  local root=$TESSERA_ARM64_ROOT work=$top/build/arm64-bullet mirror double suffix name libraries
  mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Codename: bookworm' 'Created-By: Packages' | head -1)
  rm -rf "$work"
  mkdir -p "$work/lists/partial"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" >"$work/sources.list"
  local apt=(apt-get -qq -o Dir::Etc::SourceList="$work/sources.list" -o Dir::Etc::SourceParts=/dev/null
    -o Dir::State::Lists="$work/lists")
  "${apt[@]}" update
  (cd "$work" && "${apt[@]}" source bullet)
  for double in off on; do
    suffix=''
    [ $double = off ] || suffix=-float64
    cmake -S "$work"/bullet-* -B "$work/$double" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$top/cmake/arm64.cmake" \
      -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS='-ffp-contract=off -w' -DUSE_DOUBLE_PRECISION=$double -DBUILD_SHARED_LIBS=on \
      -DBUILD_EXTRAS=on -DBUILD_BULLET_ROBOTICS_EXTRA=off -DBUILD_BULLET_ROBOTICS_GUI_EXTRA=off -DBUILD_OBJ2SDF_EXTRA=off \
      -DBUILD_BULLET2_DEMOS=off -DBUILD_OPENGL3_DEMOS=off -DBUILD_CPU_DEMOS=off -DBUILD_UNIT_TESTS=off
    libraries=(src/LinearMath/libLinearMath src/BulletCollision/libBulletCollision src/BulletDynamics/libBulletDynamics
      Extras/HACD/libHACD)
    ninja -C "$work/$double" -j "$jobs" "${libraries[@]/%/$suffix.so}"
    for name in "${libraries[@]}"; do
      cp -a "$work/$double/$name$suffix".so* "$root/usr/lib/aarch64-linux-gnu/"
    done
  done
}

configure() {
  local machine=$1 build=$top/build/$1
  case $machine in
    gcc-*) cmake --preset release -B "$build" -DCMAKE_C_COMPILER="$machine" -DCMAKE_CXX_COMPILER="g++-${machine#gcc-}" ;;
    clang-*)
      # Newer ones warn of what headers of Debian 12 do.
      cmake --preset clang -B "$build" -DTESSERA_WERROR=OFF -DCMAKE_C_COMPILER="$machine" -DCMAKE_CXX_COMPILER="clang++-${machine#clang-}"
      ;;
    arm64 | mixed) cmake --preset arm64 ;;
  esac
}

prepare() {
  case $1 in
    gcc-*) install "g++-${1#gcc-}" ;;
    clang-*) install "$1" ;;
    arm64 | mixed)
      install dpkg-dev g++-aarch64-linux-gnu mmdebstrap qemu-user-static
      make_arm64_root
      ;;
  esac
}

# passed_of FILE: "passed of all" of a log of GoogleTest.
passed_of() {
  local all passed
  all=$(sed -nE 's/^\[==========\] Running ([0-9]+) test.*/\1/p' "$1")
  passed=$(sed -nE 's/^\[  PASSED  \] ([0-9]+) test.*/\1/p' "$1")
  echo "${passed:-0} of ${all:-?}"
}

# Both builds of the daemons, and what they do together.
run_mixed_cluster() {
  configure mixed
  ninja -C "$top/build/arm64" -j "$jobs" tessera-sector-server tessera-engine-f32
  JOBS=$jobs "$top/deploy/build.sh" release tessera tessera-coordinator tessera-sector-server tessera-engine-f32
  "$top/tests/mixed_cluster.py" "$top/build/release" "$top/build/arm64"
}

machines=("$@")
[ ${#machines[@]} -gt 0 ] || machines=("${all[@]}")
for machine in "${machines[@]}"; do
  [[ " ${all[*]} " == *" $machine "* ]] || { sed -n '2,12s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
done

"$top/deploy/install_dependencies.sh" test
failed=0 rows=()
for machine in "${machines[@]}"; do
  build=$top/build/$machine
  mkdir -p "$build"
  prepare "$machine"
  if [ "$machine" = mixed ]; then
    started=$SECONDS
    if run_mixed_cluster >"$build/mixed.log" 2>&1; then outcome='the same hashes'; else outcome=failed failed=1; fi
    rows+=("mixed	$((SECONDS - started)) s	$outcome: $build/mixed.log")
    continue
  fi
  run=()
  [ "$machine" != arm64 ] || run=(qemu-aarch64-static -L "$TESSERA_ARM64_ROOT")
  started=$SECONDS
  if ! { configure "$machine" && ninja -C "$build" -j "$jobs" golden_hashes_test "${units[@]}"; } >"$build/build.log" 2>&1; then
    rows+=("$machine	does not build: $build/build.log")
    failed=1
    continue
  fi
  row="$machine	$((SECONDS - started)) s"
  for precision in f32 f64; do
    started=$SECONDS
    "${run[@]}" "$build/bin/golden_hashes_test" --precision=$precision >"$build/$precision.log" 2>&1 || failed=1
    row+="	$(passed_of "$build/$precision.log") in $((SECONDS - started)) s"
  done
  for unit in "${units[@]}"; do
    if "${run[@]}" "$build/bin/$unit" >"$build/$unit.log" 2>&1; then row+="	passed"; else row+="	failed" failed=1; fi
  done
  rows+=("$row")
done
{
  echo "machine	built in	golden f32	golden f64	$(IFS=$'\t'; echo "${units[*]}")"
  printf '%s\n' "${rows[@]}"
} | column -t -s $'\t'
exit $failed
