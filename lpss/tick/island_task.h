// Tasks for the solver: bodies, contacts and joints of islands, in the canonical order (solve_order.h).
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/partition/partition.h"
#include "lpss/tick/solve_order.h"

namespace tessera {

// One task for a solver and how much work it is.
struct SolveJob {
  SolveTask task;
  std::vector<JointId> joints;          // those of the task, in its order
  std::vector<std::size_t> group_ends;  // by contact group: the number of contacts up to its end
  std::vector<WorldBody> kinematics;    // touched by its bodies; engines keep solver state in them
};

// Collects bodies and contacts from worlds in any order and ends in the canonical one.
class TaskBuilder {
 public:
  // `frame`: the sector to whose centre the body's state is relative in its engine world.
  void add_body(BodyId id, const WorldBody& body, const SectorIndex& frame) {
    bodies_.push_back({id, body, frame, true});
  }

  // A body that does not live here: one that is shipped, or a clone that is solved like a body, by policy
  // clone. It may be the parent of any joint, and the child of those that add_joints() gets as guests.
  void add_guest(BodyId id, const WorldBody& body, const SectorIndex& frame) {
    bodies_.push_back({id, body, frame, false});
  }
  void add_contact(const ContactPair& pair, const WorldPair& place) {
    contacts_.push_back({pair.a, pair.b, pair.slot_a, pair.slot_b, place});
    contacts_.back().place.substeps = substeps_;
  }

  // The body in `place` is a clone of `original`, which is (or will be) among the bodies.
  void add_clone(const WorldBody& place, BodyId original);

  // What the contacts ask for that are added from now on; 0: what each says itself.
  void set_substeps(int substeps) { substeps_ = static_cast<std::uint16_t>(substeps); }
  void add_kinematic(const WorldBody& place) { kinematics_.push_back(place); }

  // Tells where the parent of a joint is that does not move by the task.
  using FixParent = std::function<void(const JointRecord& joint, const SectorIndex& frame, TaskJoint& task)>;

  // Adds the joints whose children live here, and `guests`, which outlive the task. All bodies have been
  // added; `complete`: the parents of all joints, too.
  void add_joints(const JointIndex& joints, std::span<const JointRecord> guests, double sector_size,
                  bool complete, const FixParent& fix_parent);

  // `anchor`: of the world.
  SolveJob build(const SectorIndex& anchor);
  bool empty() const { return bodies_.empty(); }

  // In the task; nothing for a body that is not in it. Since build().
  std::optional<std::size_t> place_of(BodyId id) const;

 private:
  struct Body {
    BodyId id;
    WorldBody place;
    SectorIndex frame;
    bool own;
  };
  struct Contact {
    BodyId a;
    BodyId b;
    BodySlot slot_a;
    BodySlot slot_b;
    WorldPair place;
  };
  class Places;
  void add_joint(const JointRecord& joint, const Body& child, double sector_size, bool complete,
                 const FixParent& fix_parent);
  const Body* find(BodyId id) const;
  std::vector<ContactToOrder> contacts_to_order(Places& places, const SectorIndex& anchor) const;
  void sort_bodies();

  std::vector<Body> bodies_;
  std::vector<Contact> contacts_;
  std::vector<std::pair<JointId, TaskJoint>> joints_;
  std::vector<std::pair<BodyId, WorldBody>> clones_;
  std::vector<WorldBody> kinematics_;
  std::uint16_t substeps_ = 0;
};

// Adds a component's bodies and contacts to a task. Its clones are bodies of the task themselves, or stand
// for their originals.
void add_component(const Partition& partition, Sector& sector, const Component& component,
                   TaskBuilder& builder, bool clones_as_bodies);

// Builds a task with the joints of its bodies. Policy clone: those that have both of their bodies in the
// sector. `guests`: of bodies that others have shipped; they outlive the task.
SolveJob build_job(const Partition& partition, TaskBuilder& builder,
                   std::span<const JointRecord> guests = {});

}  // namespace tessera
