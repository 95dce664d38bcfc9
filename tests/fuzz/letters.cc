// Messages between daemons, to a coordinator and a server that run a world: whatever a member of the bus
// says, and whoever it says to be.
#include "inputs.pb.h"
#include "proto/convert.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/small_cluster.h"

namespace tessera::fuzz {
namespace {

constexpr int kLettersMax = 16;

// Numbers of worlds and serial numbers of grants are easy to guess, so inputs need not.
void address(const Letter& letter, std::uint64_t world, v1::ClusterMessage& message) {
  if (!letter.current()) return;
  if (message.has_grant()) message.mutable_grant()->set_world(world);
  if (message.has_round()) message.mutable_round()->set_world(world);
  if (message.has_report()) message.mutable_report()->set_world(world);
  if (message.has_loaded()) message.mutable_loaded()->set_world(world);
  if (message.has_answer()) message.mutable_answer()->set_world(world);
  if (message.has_load_world()) message.mutable_load_world()->set_world(world + 1);
}

}  // namespace
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  fuzz::Letters letters;
  if (!fuzz::read_text(fuzz::text_of(data, size), letters)) return 0;
  if (letters.all_size() > fuzz::kLettersMax) return 0;
  fuzz::SmallCluster cluster;
  v1::LoadRequest load;
  *load.mutable_world() = to_proto(fuzz::small_world());
  cluster.ask<v1::LoadReply>(load);
  std::uint64_t world = 1;
  for (const fuzz::Letter& letter : letters.all()) {
    v1::ClusterMessage message = letter.message();
    fuzz::address(letter, world, message);
    if (message.has_load_world()) world = message.load_world().world();
    const NodeId from = letter.from() == 0 ? kCoordinatorNode : NodeId{letter.from()};
    if (letter.to_coordinator()) {
      cluster.to_coordinator(letter.from() == 0 ? fuzz::kServer : from, message);
    } else {
      cluster.to_server(from, message);
    }
  }
  return 0;
}
