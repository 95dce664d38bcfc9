#include "lpss/bullet/bullet_engine.h"

#include <cstdio>
#include <cstdlib>

#include "lpss/bullet/bullet_solver.h"
#include "lpss/bullet/bullet_world.h"

namespace tessera::bullet {

void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "tessera engine: %s\n", rule);
  std::abort();
}

std::unique_ptr<SectorWorld> BulletEngine::make_world() { return std::make_unique<BulletWorld>(*this); }

std::unique_ptr<IslandSolver> BulletEngine::make_solver() {
  return std::make_unique<BulletSolver>(settings_);
}

}  // namespace tessera::bullet
