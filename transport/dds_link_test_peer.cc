// The other processes of dds_link_test:
//   dds_link_test_peer DOMAIN CLUSTER SELF MODE [ARGUMENTS]
// with the keys in the folder that the variable TESSERA_TEST_KEYS names, if it is set. Modes:
// echo N          answers each message with the same payload, until one says "quit"
// mesh FIRST LAST sends one message to every other node of the range; when it has received one from each,
// sends
//                 "complete" to node 1, and continues until node 1 sends "quit"
// coordinate      announces itself as the coordinator at endpoint "here:SELF", sends the result to node 2,
// and
//                 echoes
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>

#include "transport/dds_link.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

// A failed test must not leave processes behind.
constexpr std::chrono::seconds kLifetime{100};

int echo(Link& link) {
  const Clock::time_point deadline = Clock::now() + kLifetime;
  while (Clock::now() < deadline) {
    for (Delivery& delivery : link.receive(deadline)) {
      if (delivery.payload == "quit") return 0;
      link.send(delivery.from, std::move(delivery.payload));
    }
  }
  return 3;
}

int mesh(Link& link, std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t node = first; node <= last; ++node) {
    if (NodeId{node} != link.self()) link.send(NodeId{node}, "hello");
  }
  const Clock::time_point deadline = Clock::now() + kLifetime;
  std::set<NodeId> heard;
  while (Clock::now() < deadline) {
    for (const Delivery& delivery : link.receive(deadline)) {
      if (delivery.payload == "quit") return 0;
      if (delivery.payload != "hello" || !heard.insert(delivery.from).second) return 4;
      if (heard.size() == last - first) link.send(NodeId{1}, "complete");
    }
  }
  return 3;
}

int run(int argc, char** argv) {
  if (argc < 5) return 2;
  const std::string mode = argv[4];
  const char* keys = std::getenv("TESSERA_TEST_KEYS");
  auto link = DdsLink::create({.domain = static_cast<std::uint32_t>(std::atoi(argv[1])),
                               .cluster = argv[2],
                               .network = {.keys = keys != nullptr ? keys : ""},
                               .self = NodeId{std::strtoull(argv[3], nullptr, 10)}});
  if (!link.ok()) {
    std::fprintf(stderr, "%s\n", link.status().ToString().c_str());
    return 1;
  }
  if (mode == "echo") return echo(**link);
  if (mode == "mesh" && argc == 7) {
    return mesh(**link, std::strtoull(argv[5], nullptr, 10), std::strtoull(argv[6], nullptr, 10));
  }
  if (mode == "coordinate") {
    const absl::Status status = (*link)->announce_coordinator(std::string("here:") + argv[3]);
    (*link)->send(NodeId{2}, status.ToString());
    return echo(**link);
  }
  return 2;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) { return tessera::run(argc, argv); }
