#!/usr/bin/env bash
# Simulates a cluster of several hosts: one network namespace for each, connected by a switch. Then verifies that the
# world hash is the same as in one process. Needs root.
#
#   deploy/network_namespaces.sh                             worlds/seam.sdf, 2 sector servers, 600 ticks
#   deploy/network_namespaces.sh -n 3 -t 600 -d 1ms worlds/busy.sdf
#
#   -n SERVERS   number of hosts with a sector server each; another one runs the coordinator
#   -t TICKS     number of ticks
#   -d DELAY     added to every packet towards a host, in the format of tc-netem (needs kernel support)
#   -b FOLDER    folder of the programs, instead of build/release/bin
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
servers=2 ticks=600 delay='' bin=$top/build/release/bin
while getopts n:t:d:b: option; do
  case $option in
    n) servers=$OPTARG ;;
    t) ticks=$OPTARG ;;
    d) delay=$OPTARG ;;
    b) bin=$OPTARG ;;
    *) exit 2 ;;
  esac
done
shift $((OPTIND - 1))
world=${1:-$top/worlds/seam.sdf}
[ "$(id -u)" -eq 0 ] || { echo "network namespaces need root" >&2; exit 1; }
command -v ip >/dev/null || { echo "the command ip is missing: apt-get install iproute2" >&2; exit 1; }

prefix=tessera-$$
scratch=$(mktemp -d)
pids=()
clean_up() {
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
  for name in switch $(seq 0 "$servers"); do ip netns delete "$prefix-$name" 2>/dev/null || true; done
  rm -rf "$scratch"
}
trap clean_up EXIT

address() { echo "10.77.0.$((1 + $1))"; }
on_host() {
  local host=$1
  shift
  ip netns exec "$prefix-$host" "$@"
}

ip netns add "$prefix-switch"
on_host switch ip link add switch type bridge
on_host switch ip link set switch up
peers=
for host in $(seq 0 "$servers"); do
  ip netns add "$prefix-$host"
  on_host switch ip link add "port$host" type veth peer name eth0 netns "$prefix-$host"
  on_host switch ip link set "port$host" master switch up
  on_host "$host" ip addr add "$(address "$host")/24" dev eth0
  on_host "$host" ip link set lo up
  on_host "$host" ip link set eth0 up
  [ -z "$delay" ] || on_host switch tc qdisc add dev "port$host" root netem delay "$delay"
  peers=$peers${peers:+,}$(address "$host")
done

# The daemons listen beyond loopback, so they have keys.
"$bin/tessera" keys create "$scratch/keys" >/dev/null
shared=(--keys "$scratch/keys" --interface eth0 --peers "$peers" --cluster namespaces --exit-with-parent)
listen=$(address 0):7300
start() {
  local host=$1
  shift
  on_host "$host" "$@" "${shared[@]}" 2>"$scratch/host-$host.log" &
  pids+=($!)
}
start 0 "$bin/tessera-coordinator" --listen "$listen" --servers "$servers" --ready-file "$scratch/ready"
for host in $(seq "$servers"); do
  start "$host" "$bin/tessera-sector-server" --threads 1 --listen "$(address "$host"):7301"
done
fail() {
  echo "$1" >&2
  tail -n 5 "$scratch"/host-*.log >&2
  exit 1
}
for _ in $(seq 100); do
  [ -s "$scratch/ready" ] && break
  sleep 0.1
done
[ -s "$scratch/ready" ] || fail "the coordinator is not ready"

tessera() { on_host 0 "$bin/tessera" "$@" --connect "$listen" --keys "$scratch/keys" --json "$scratch/$1.json"; }
tessera load "$world" || fail "cannot load the world"
began=$(date +%s%N)
tessera step "$ticks" || fail "cannot step the world"
took_ms=$((($(date +%s%N) - began) / 1000000))
tessera status
tessera hash >/dev/null
hash_of() { sed -n 's/.*"hash": *"\([0-9a-f]*\)".*/\1/p; s/.*"world_hash": *"\([0-9a-f]*\)".*/\1/p' "$1"; }
there=$(hash_of "$scratch/hash.json")
tessera shutdown >/dev/null

seconds=$(awk "BEGIN { print $ticks / 60 }")
"$bin/tessera" run "$world" --in-process --seconds "$seconds" --json "$scratch/alone.json" >/dev/null
here=$(hash_of "$scratch/alone.json")
echo "$ticks ticks on $servers hosts in $took_ms ms; world hash $there"
if [ "$there" != "$here" ]; then
  echo "error: in one process it is $here" >&2
  exit 1
fi
echo "the same as in one process"
