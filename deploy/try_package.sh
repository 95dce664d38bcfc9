#!/usr/bin/env bash
# Tests the packages built by deploy/package.sh in a minimal Debian root: installs them, looks at manual pages and
# completion, runs a coordinator and two sector servers with the command lines of their units, builds the SDK's example
# against the installed files (with CMake and with pkg-config) and runs it, removes the packages, and looks for leftovers.
# Needs root, debootstrap and some minutes.
#
#   deploy/try_package.sh [MIRROR]
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
mirror=${1:-http://deb.debian.org/debian}
packages=$top/build/release/package
root=$(mktemp -d)
chmod 755 "$root"  # for the users inside
pids=()
clean_up() {
  [ "$?" -eq 0 ] || tail -n 5 "$root"/tmp/*.log >&2 || true
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
  umount "$root/proc" "$root/dev" 2>/dev/null || true
  mountpoint -q "$root/proc" || mountpoint -q "$root/dev" || rm -rf "$root"
}
trap clean_up EXIT
inside() { chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"; }
say() { printf '%s\n' "$*"; }
files() { inside find /etc /usr /var/lib/tessera -xdev 2>/dev/null | sort; }

debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1 || { tail -5 "$root.log" >&2; exit 1; }
rm -f "$root.log"
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
inside apt-get update -qq
apt_get() { inside apt-get -qq -y --no-install-recommends "$@" >"$root/tmp/apt.log" 2>&1 || { tail -5 "$root/tmp/apt.log" >&2; exit 1; }; }
say "bare root: $(inside dpkg-query -f '.\n' -W | wc -l) packages"

cp "$packages"/*.deb "$root/tmp/"
apt_get install "/tmp/$(basename "$packages"/tessera_*.deb)"
say "installed: tessera $(inside dpkg-query -f '${Version}, ${Installed-Size} KB' -W tessera)"

completed=$(inside bash -c 'source /usr/share/bash-completion/completions/tessera
COMP_WORDS=(tessera lo) COMP_CWORD=1
_tessera tessera lo tessera
echo "${COMPREPLY[*]}"')
[ "$completed" = load ] || { say "bash completes tessera lo as: $completed" >&2; exit 1; }
zcat "$root/usr/share/man/man1/tessera-run.1.gz" | grep -q '^.SH SYNOPSIS$' || { say "no manual page of tessera run" >&2; exit 1; }
say "manual pages: $(inside find /usr/share/man/man1 -name 'tessera*' | wc -l); bash completes tessera lo: $completed"

# As systemd would, with a user like the one it would create.
inside useradd --system --no-create-home tessera-dynamic
start_unit() {
  local command
  command=$(sed -n 's/^ExecStart=//p' "$root/usr/lib/systemd/system/$1")
  # shellcheck disable=SC2086  # split the unit's command into words
  chroot --userspec=tessera-dynamic "$root" /usr/bin/env -i PATH=/usr/bin $command 2>"$root/tmp/$2.log" &
  pids+=($!)
}
start_unit tessera-coordinator.service coordinator
start_unit tessera-sector-server@.service server-1
start_unit tessera-sector-server@.service server-2
for _ in $(seq 100); do
  [ "$(grep -c ' joined, ' "$root/tmp/coordinator.log")" -ge 2 ] && break
  sleep 0.1
done
inside tessera load /usr/share/tessera/worlds/tower.sdf
inside tessera step 60

apt_get install "/tmp/$(basename "$packages"/python3-tessera_*.deb)"
answer=$(inside /usr/bin/python3 -c "import tessera
s = tessera.Simulation('/usr/share/tessera/worlds/tower.sdf')
s.step(60)
print(s.hash() == tessera.Client().hash(), s.hash().hash)")
[[ $answer == True* ]] || { say "Python has another hash than the cluster: $answer" >&2; exit 1; }
say "in a process of Python, the same hash: ${answer#True }"

apt_get install g++ cmake pkg-config make "/tmp/$(basename "$packages"/libtessera-dev_*.deb)"
mkdir -p "$root/tmp/hello"
cp "$top/client_sdk/examples/hello.cc" "$root/tmp/hello/"
cat >"$root/tmp/hello/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.25)
project(hello LANGUAGES CXX)
find_package(tessera REQUIRED)
add_executable(hello hello.cc)
target_link_libraries(hello PRIVATE tessera::client)
CMAKE
inside sh -ec 'cd /tmp/hello && cmake -B build . >/dev/null && cmake --build build >/dev/null'
answer=$(inside /tmp/hello/build/hello | tail -1)
say "built with find_package(tessera): $answer"
inside tessera remove crate
inside sh -ec 'cd /tmp/hello && g++ -std=c++20 hello.cc $(pkg-config --cflags --libs tessera) -o by_pkg_config'
answer=$(inside /tmp/hello/by_pkg_config | tail -1)
say "built with pkg-config: $answer"

inside tessera shutdown
for pid in "${pids[@]}"; do wait "$pid" || { say "a daemon ended with an error"; tail "$root"/tmp/*.log; exit 1; }; done
pids=()
apt_get purge tessera libtessera-dev python3-tessera
left=$(files | grep -i tessera || true)
if [ -n "$left" ]; then
  say "left behind:" "$left" >&2
  exit 1
fi
say "removed: nothing is left"
