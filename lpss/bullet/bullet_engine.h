// The engine interface over Bullet's own worlds, in one precision: the policy clone, as the paper has it, and
// the baseline of experiments.
#pragma once

#include <memory>

#include "lpss/bullet/collision_shape.h"
#include "lpss/engine/shape_table.h"
#include "lpss/engine/whole_world.h"

namespace tessera::bullet {

using CollisionShapeRef = std::shared_ptr<const CollisionShape>;

class BulletEngine final : public Engine {
 public:
  explicit BulletEngine(const EngineSettings& settings) : settings_(settings) {}

  const EngineSettings& settings() const override { return settings_; }
  void add_shape(ShapeId id, const Shape& shape) override {
    require(!tessera::has_triggers(shape), "Bullet's own worlds have no triggers");
    shapes_.add(id, shape);
  }
  void forget_shape(ShapeId id) override { shapes_.forget(id); }
  std::unique_ptr<SectorWorld> make_world() override;
  std::unique_ptr<IslandSolver> make_solver() override;
  int substeps(int asked, std::size_t /*bodies*/) const override { return asked; }
  std::unique_ptr<StagedSolver> make_staged_solver() override { return nullptr; }
  std::unique_ptr<WholeWorld> make_whole_world() override;
  bool can_read(const ManifoldState& manifold) const override;
  void set_apart(BodyId a, BodyId b, bool apart) override { apart_.set(a, b, apart); }
  bool are_apart(BodyId a, BodyId b) const { return apart_.contains(a, b); }

  // Safe to call from any thread. Stops the process if the shape is unknown.
  CollisionShapeRef shape_of(const BodyProperties& properties) { return shapes_.of(properties); }

 private:
  const EngineSettings settings_;
  ApartPairs apart_;
  ShapeTable<CollisionShape> shapes_;
};

}  // namespace tessera::bullet
