// Puts islands together for the solver: those inside a sector, those over several, those over several servers.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <memory>
#include <mutex>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/grid/sector_map.h"
#include "lpss/world/messages.h"
#include "lpss/world/seam_graph.h"
#include "lpss/world/sector.h"

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
  void add_body(BodyId id, const WorldBody& body) { bodies_.push_back({id, body}); }
  void add_contact(const ContactPair& pair, const WorldPair& place) { contacts_.push_back({pair.a, pair.b, place}); }

  // The body in `place` is a clone of `original`, which is (or will be) among the bodies.
  void add_clone(const WorldBody& place, BodyId original);
  void add_kinematic(const WorldBody& place) { kinematics_.push_back(place); }

  SolveJob build();
  bool empty() const { return bodies_.empty(); }

 private:
  struct Body {
    BodyId id;
    WorldBody place;
  };
  struct Contact {
    BodyId a;
    BodyId b;
    WorldPair place;
  };
  std::vector<Body> bodies_;
  std::vector<Contact> contacts_;
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
