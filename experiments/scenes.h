// What experiments with many scenes have in common.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <initializer_list>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/report.h"

namespace tessera {

// Those of all groups, one group after the other.
template <typename Scene>
std::vector<Scene> joined(std::initializer_list<std::vector<Scene>> groups) {
  std::vector<Scene> all;
  for (const std::vector<Scene>& group : groups) all.insert(all.end(), group.begin(), group.end());
  return all;
}

// Keeps those whose "group name" contains `only`. INVALID_ARGUMENT where none does.
template <typename Scene>
absl::Status choose(const std::string& only, std::vector<Scene>& scenes) {
  std::erase_if(scenes, [&](const Scene& scene) {
    return !absl::StrContains(absl::StrCat(scene.group, " ", scene.name), only);
  });
  if (!scenes.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("No scene's \"group name\" contains \"", only, "\"."));
}

// The reports of all, one after the other. Errors: those of `measure`, CANCELLED.
template <typename Scenes, typename Measure>
absl::StatusOr<Report> measure_each(const Scenes& scenes, const Progress& progress, const Measure& measure) {
  Report report;
  ProgressCount count(progress, std::size(scenes), report);
  for (const auto& scene : scenes) {
    absl::StatusOr<Report> part = measure(scene);
    if (!part.ok()) return part.status();
    report.append(*std::move(part));
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  return report;
}

}  // namespace tessera
