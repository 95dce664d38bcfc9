// The engine interface over Bullet, in one precision.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include "lpss/bullet/collision_shape.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

using CollisionShapeRef = std::shared_ptr<const CollisionShape>;

// Shapes are shared by all bodies with the same shape and centre frame, in all worlds.
class BulletEngine final : public Engine {
 public:
  explicit BulletEngine(const EngineSettings& settings) : settings_(settings) {}

  const EngineSettings& settings() const override { return settings_; }
  void add_shape(ShapeId id, const Shape& shape) override;
  std::unique_ptr<SectorWorld> make_world() override;
  std::unique_ptr<IslandSolver> make_solver() override;
  std::unique_ptr<PartSolver> make_part_solver() override;

  // Counts: as many joints may keep a pair apart as tie it, and each takes back only its own.
  void set_apart(BodyId a, BodyId b, bool apart) override;
  bool are_apart(BodyId a, BodyId b) const { return !apart_.empty() && apart_.contains(pair_key(a, b)); }

  // All threads. Stops the process where the shape is not known.
  CollisionShapeRef shape_of(const BodyProperties& properties);

 private:
  using ShapeKey = std::tuple<ShapeId, std::array<double, 3>, std::array<double, 4>, bool>;

  // Ids have 31 bits.
  static std::uint64_t pair_key(BodyId a, BodyId b) {
    return a < b ? a.value << 32 | b.value : b.value << 32 | a.value;
  }

  const EngineSettings settings_;
  absl::flat_hash_map<std::uint64_t, int> apart_;  // how many joints keep the pair apart; > 0
  std::mutex mutex_;                               // guards all below
  std::map<ShapeId, Shape> shapes_;
  std::map<ShapeKey, CollisionShapeRef> built_;
};

// Stops the process with a message where the caller broke a rule of the interface.
void require(bool holds, const char* rule);

}  // namespace tessera::bullet
