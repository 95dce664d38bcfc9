// Tasks for the solver: bodies, contacts and joints of islands, in the canonical order (solve_order.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/solve_order.h"

namespace tessera {

// One task for a solver.
struct SolveJob {
  SolveTask task;
  std::vector<BodyId> bodies;           // of the task, by place
  std::vector<std::size_t> stage_ends;  // by contact stage, of the last island: the contacts up to its end

  std::size_t weight() const { return task.contacts.size() + task.bodies.size(); }
};

// Collects the parts of islands in any order, and ends in the canonical one.
class TaskBuilder {
 public:
  // The partition, and all that is added, outlive the job.
  explicit TaskBuilder(const Partition& partition) : partition_(&partition) {}

  // What is added from now on is one island. It asks for so many substeps; 0: as its contacts do.
  void begin_island(int substeps = 0);

  // A component's bodies and contacts. Its clones are bodies themselves, or stand for their originals, by
  // policy.
  void add(const Sector& sector, const Component& component);

  // What others have shipped: a body, a pair, and a joint whose child is one of those bodies.
  void add_body(const ShippedIsland& parcel, std::size_t n);
  void add_pair(const ShippedIsland& parcel, std::size_t n);
  void add_joint(const JointRecord& joint) { guests_.push_back(&joint); }

  // With the joints of its bodies. Policy clone: those that have both of their bodies in the sector.
  void end_island();

  // In the task; nothing for a body that is not in the last island that has ended.
  std::optional<std::size_t> place_of(BodyId id) const;

  SolveJob build();

 private:
  struct Member {
    BodyId id;
    WorldBody place;
    SectorIndex frame;          // to whose centre the body's state is relative in its world
    bool has_joints = false;    // of this partition
    bool stands_for = false;    // a clone, for its original
    std::uint32_t in_task = 0;  // from the island's first body on
  };
  struct Contact {
    BodyId a;
    BodyId b;
    WorldPair pair;
    std::uint32_t member_a;  // kNone: it cannot be pushed
    std::uint32_t member_b;
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::uint32_t add_member(const Member& member);
  std::uint32_t& member_in(BodySlot slot) {
    const auto place = static_cast<std::size_t>(slot);
    if (place >= by_slot_.size()) by_slot_.resize(place + 1, kNone);
    return by_slot_[place];
  }
  const Member* find(BodyId id) const;
  void place_members();
  void order_contacts();
  void add_joints();
  void add_joint(const JointRecord& joint, const Member& child);
  void fix_parent(const JointRecord& record, const SectorIndex& frame, IslandJoint& joint) const;

  const Partition* partition_;
  SolveJob job_;
  int substeps_ = 0;
  bool is_given_ = false;  // the number of substeps
  std::vector<Member> members_;
  std::vector<std::uint32_t> bodies_;  // the members that are bodies, in their order
  std::vector<Contact> contacts_;
  std::vector<const JointRecord*> guests_;
  std::vector<std::uint32_t> by_slot_;  // of the world that is added: members, or kNone
  std::vector<ContactToOrder> to_order_;
  SolveOrder order_;
};

}  // namespace tessera
