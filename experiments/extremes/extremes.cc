#include "experiments/extremes/extremes.h"

#include <vector>

#include "experiments/extremes/row.h"
#include "experiments/scenes.h"

namespace tessera {
namespace extremes {

std::vector<Scene> all_scenes() {
  return joined({place_scenes(), body_scenes(), terrain_scenes(), motion_scenes(), pile_scenes(),
                 input_scenes(), long_scenes()});
}

}  // namespace extremes

absl::StatusOr<Report> measure_extremes(const ExperimentOptions& options, const Progress& progress) {
  std::vector<extremes::Scene> scenes = extremes::all_scenes();
  if (absl::Status status = choose(options.only, scenes); !status.ok()) return status;
  return measure_each(scenes, progress,
                      [&](const extremes::Scene& scene) { return extremes::measure_apart(scene, options); });
}

}  // namespace tessera
