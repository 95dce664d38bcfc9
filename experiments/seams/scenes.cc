#include <iterator>

#include "experiments/seams/scene.h"

namespace tessera::seams {

std::vector<Scene> all_scenes(const std::string& worlds) {
  std::vector<Scene> scenes;
  for (std::vector<Scene> group :
       {collision_scenes(), stack_scenes(), toppling_scenes(), joint_scenes(), vehicle_scenes(worlds),
        rolling_scenes(), crossing_scenes(), pile_scenes()}) {
    std::move(group.begin(), group.end(), std::back_inserter(scenes));
  }
  return scenes;
}

}  // namespace tessera::seams
