// Puts islands together for the solver: those inside a sector, those over several, those over several
// servers.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/grid/sector_map.h"
#include "lpss/partition/joint_index.h"
#include "lpss/partition/seam_graph.h"
#include "lpss/partition/sector.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Solvers for as many threads as want one.
class SolverPool {
 public:
  explicit SolverPool(Engine& engine) : engine_(engine) {}

  std::unique_ptr<IslandSolver> take();
  void put_back(std::unique_ptr<IslandSolver> solver);

 private:
  Engine& engine_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<IslandSolver>> idle_;
};

// One task for a solver and how much work it is.
struct SolveJob {
  SolveTask task;
  std::vector<WorldBody> kinematics;  // touched by its bodies; engines keep solver state in them
};

// Collects bodies and contacts from worlds in any order and ends in the canonical one.
class TaskBuilder {
 public:
  // `frame`: the sector to whose centre the body's state is relative in its engine world.
  void add_body(BodyId id, const WorldBody& body, const SectorIndex& frame) {
    bodies_.push_back({id, body, frame, true});
  }

  // A body of another part of the island: it may be the parent of a joint, but its own joints are not this
  // task's.
  void add_copy(BodyId id, const WorldBody& body, const SectorIndex& frame) {
    bodies_.push_back({id, body, frame, false});
  }
  void add_contact(const ContactPair& pair, const WorldPair& place) {
    contacts_.push_back({pair.a, pair.b, place});
  }

  // The body in `place` is a clone of `original`, which is (or will be) among the bodies.
  void add_clone(const WorldBody& place, BodyId original);
  void add_kinematic(const WorldBody& place) { kinematics_.push_back(place); }

  // Adds the joints of the bodies, all of which have been added; `fix_parent` tells where a parent that does
  // not move by the task is. `complete`: that the other body of each joint has been added, too.
  using FixParent = std::function<void(const JointRecord& joint, const SectorIndex& frame, TaskJoint& task)>;
  void add_joints(const JointIndex& joints, double sector_size, bool complete, const FixParent& fix_parent);

  SolveJob build();
  bool empty() const { return bodies_.empty(); }

  // The place of a body in the task, if it has it. Once the task is built.
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
    WorldPair place;
  };
  const Body* find(BodyId id) const;
  void sort_bodies();

  std::vector<Body> bodies_;
  std::vector<Contact> contacts_;
  std::vector<std::pair<JointId, TaskJoint>> joints_;
  std::vector<std::pair<BodyId, WorldBody>> clones_;
  std::vector<WorldBody> kinematics_;
};

// The engine worlds that carry another server's part of an island to the solver. Nothing is detected in them.
class Carriers {
 public:
  // Fills `builder` with the shipped bodies and contacts. `own` are the bodies of this share that the shipped
  // contacts may refer to as clones.
  Carriers(Engine& engine, double sector_size, const std::vector<const ShippedIsland*>& shipped,
           const absl::flat_hash_map<BodyId, BodyRecord>& own, TaskBuilder& builder);

  bool carries(BodyId id) const { return homes_.contains(id); }

  // The solved bodies and contacts, each to be sent to the server that owns its sector.
  void collect(const SectorMap& map, std::vector<Solution>& outbox) const;

 private:
  SectorWorld& world_of(const SectorIndex& sector);

  struct Carried {
    SectorIndex home;
    WorldBody place;
  };

  Engine& engine_;
  absl::flat_hash_map<SectorIndex, std::unique_ptr<SectorWorld>> worlds_;
  absl::flat_hash_map<BodyId, Carried> homes_;
  std::vector<std::pair<SectorIndex, WorldPair>> contacts_;
};

}  // namespace tessera
