// A world made by hand on one server or two, taken through the phases of a tick up to the one under test.
#pragma once

#include <absl/functional/function_ref.h>

#include <cstddef>
#include <deque>
#include <vector>

#include "lpss/partition/test_partition.h"
#include "lpss/tick/context.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// What one server received, by sender.
template <typename Message>
std::vector<Message> received(const std::vector<std::vector<Message>>& outboxes, Rank rank) {
  std::vector<Message> inbox;
  for (const std::vector<Message>& outbox : outboxes) inbox.push_back(outbox[rank]);
  return inbox;
}

// A loop as threads may run it: the last piece first.
inline const ParallelFor kLastFirst = [](std::size_t count, absl::FunctionRef<void(std::size_t)> body) {
  while (count > 0) body(--count);
};

class TestWorld {
 public:
  explicit TestWorld(std::uint32_t servers = 1, const WorldSettings& settings = test_settings());

  // On every server.
  void add(const BodyRecord& record);
  void add(const JointRecord& record, const std::vector<JointTie>& leaders = {});

  Partition& operator[](Rank rank) { return *partitions_[rank]; }
  Partition& host(const SectorIndex& index);
  Sector& sector(const SectorIndex& index) { return *host(index).sectors.at(index); }
  BodyState state(std::uint64_t id);

  // Each begins where the one before it ends, on all servers.
  void exchange();  // who is near a seam, and the clones that follow from it
  void detect();    // contacts
  void connect();   // components
  void plan();      // islands
  void solve();     // solutions are back at the owners
  void run_to_solved() {
    exchange();
    detect();
    connect();
    plan();
    solve();
  }

  // By rank; what the phases have left.
  std::vector<TickContext> contexts;
  std::vector<Seams> seams;
  std::vector<std::vector<Shipment>> shipments;
  std::vector<std::vector<Solution>> solutions;

 private:
  Rank servers() const { return static_cast<Rank>(partitions_.size()); }

  std::deque<TestPartition> partitions_;
};

// A hinge of two boxes, half way between them: the parent reaches 0.5 m along x, the child 0.5 m back.
JointRecord hinge(std::uint64_t id, std::uint64_t parent, std::uint64_t child);

}  // namespace tessera
