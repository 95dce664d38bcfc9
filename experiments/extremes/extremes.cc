#include "experiments/extremes/extremes.h"

#include <absl/status/status.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <iterator>
#include <vector>

#include "experiments/extremes/row.h"

namespace tessera {
namespace extremes {

std::vector<Scene> all_scenes() {
  std::vector<Scene> all;
  for (const auto& scenes :
       {place_scenes, body_scenes, terrain_scenes, motion_scenes, pile_scenes, input_scenes, long_scenes}) {
    std::vector<Scene> more = scenes();
    std::move(more.begin(), more.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace extremes

absl::StatusOr<Report> measure_extremes(const ExperimentOptions& options, const Progress& progress) {
  std::vector<extremes::Scene> scenes = extremes::all_scenes();
  std::erase_if(scenes, [&](const extremes::Scene& scene) {
    return !absl::StrContains(absl::StrCat(scene.group, " ", scene.name), options.only);
  });
  if (scenes.empty())
    return absl::InvalidArgumentError(
        absl::StrCat("No scene's \"group name\" contains \"", options.only, "\"."));
  ProgressCount count(progress, scenes.size());
  Report report;
  for (const extremes::Scene& scene : scenes) {
    report.append(extremes::measure_apart(scene, options));
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  return report;
}

}  // namespace tessera
