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

  // Reference-counted: several joints may exclude the same pair, and each removes only its own exclusion.
  void set_apart(BodyId a, BodyId b, bool apart) override;
  bool are_apart(BodyId a, BodyId b) const { return !apart_.empty() && apart_.contains(pair_key(a, b)); }

  // Safe to call from any thread. Stops the process if the shape is unknown.
  CollisionShapeRef shape_of(const BodyProperties& properties);

 private:
  using ShapeKey = std::tuple<ShapeId, std::array<double, 3>, std::array<double, 4>, bool>;

  // Ids have 31 bits.
  static std::uint64_t pair_key(BodyId a, BodyId b) {
    return a < b ? a.value << 32 | b.value : b.value << 32 | a.value;
  }

  const EngineSettings settings_;
  absl::flat_hash_map<std::uint64_t, int> apart_;  // number of joints that exclude the pair; > 0
  std::mutex mutex_;                               // guards all members below
  std::map<ShapeId, Shape> shapes_;
  std::map<ShapeKey, CollisionShapeRef> built_;
};

// Stops the process with a message if the caller violated the interface.
void require(bool holds, const char* rule);

}  // namespace tessera::bullet
