#include "experiments/extremes/extremes.h"

#include <iterator>

#include "experiments/extremes/row.h"

namespace tessera {
namespace extremes {

std::vector<Scene> all_scenes() {
  std::vector<Scene> all;
  for (const auto& scenes :
       {place_scenes, body_scenes, motion_scenes, pile_scenes, input_scenes, long_scenes}) {
    std::vector<Scene> more = scenes();
    std::move(more.begin(), more.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace extremes

absl::StatusOr<Report> measure_extremes(const ExperimentOptions& options, const Progress& progress) {
  const std::vector<extremes::Scene> scenes = extremes::all_scenes();
  ProgressCount count(progress, scenes.size());
  Report report;
  for (const extremes::Scene& scene : scenes) {
    report.append(extremes::measure_apart(scene, options));
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  return report;
}

}  // namespace tessera
