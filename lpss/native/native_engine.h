// The engine interface over Tessera's own pipeline, in one precision.
#pragma once

#include <memory>

#include "lpss/engine/shape_table.h"
#include "lpss/engine/whole_world.h"
#include "lpss/islands/contact_needs.h"
#include "lpss/native/body_form.h"

namespace tessera::native {

Substepping substepping_of(const WorldSettings& settings);

// Forms are shared by all bodies with the same shape and centre frame, in all worlds.
class NativeEngine final : public Engine {
 public:
  explicit NativeEngine(const EngineSettings& settings)
      : settings_(settings), needs_(substepping_of(settings)) {}

  const EngineSettings& settings() const override { return settings_; }
  const ContactNeeds& needs() const { return needs_; }
  void add_shape(ShapeId id, const Shape& shape) override { forms_.add(id, shape); }
  void forget_shape(ShapeId id) override { forms_.forget(id); }
  std::unique_ptr<SectorWorld> make_world() override;
  std::unique_ptr<IslandSolver> make_solver() override;
  int substeps(int asked, std::size_t bodies) const override { return needs_.granted(asked, bodies); }
  std::unique_ptr<StagedSolver> make_staged_solver() override;
  std::unique_ptr<WholeWorld> make_whole_world() override { return nullptr; }
  bool can_read(const ManifoldState& manifold) const override;
  ManifoldState turned(const ManifoldState& manifold, const Eigen::Matrix3d& turn) const override;
  void set_apart(BodyId a, BodyId b, bool apart) override { apart_.set(a, b, apart); }
  bool are_apart(BodyId a, BodyId b) const { return apart_.contains(a, b); }

  // Safe to call from any thread. Stops the process if the shape is unknown.
  std::shared_ptr<const BodyForm> form_of(const BodyProperties& properties) { return forms_.of(properties); }

 private:
  const EngineSettings settings_;
  const ContactNeeds needs_;
  ApartPairs apart_;
  ShapeTable<BodyForm> forms_;
};

}  // namespace tessera::native
