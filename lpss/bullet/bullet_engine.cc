#include "lpss/bullet/bullet_engine.h"

#include <vector>

#include "lpss/bullet/bullet_solver.h"
#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/discrete_world.h"
#include "lpss/bullet/manifold_codec.h"

namespace tessera::bullet {

std::unique_ptr<SectorWorld> BulletEngine::make_world() { return std::make_unique<BulletWorld>(*this); }

std::unique_ptr<IslandSolver> BulletEngine::make_solver() {
  return std::make_unique<BulletSolver>(settings_);
}

std::unique_ptr<WholeWorld> BulletEngine::make_whole_world() {
  return std::make_unique<DiscreteWorld>(*this);
}

bool BulletEngine::can_read(const ManifoldState& manifold) const {
  std::vector<ManifoldRecord> read;
  return decode_manifolds(manifold.points, read);
}

}  // namespace tessera::bullet
