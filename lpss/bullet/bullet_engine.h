// The engine interface over Bullet, in one precision.
#pragma once

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

  // All threads. Stops the process where the shape is not known.
  CollisionShapeRef shape_of(const BodyProperties& properties);

 private:
  using ShapeKey = std::tuple<ShapeId, std::array<double, 3>, std::array<double, 4>, bool>;

  const EngineSettings settings_;
  std::mutex mutex_;  // guards all below
  std::map<ShapeId, Shape> shapes_;
  std::map<ShapeKey, CollisionShapeRef> built_;
};

// Stops the process with a message where the caller broke a rule of the interface.
void require(bool holds, const char* rule);

}  // namespace tessera::bullet
