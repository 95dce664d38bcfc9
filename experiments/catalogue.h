// The experiments of `tessera experiment`, except `seams`, which needs servers.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cli/measure/report.h"
#include "lpss/model/world_description.h"

namespace tessera {

struct ExperimentOptions {
  Precision precision = Precision::kFloat32;
  bool quick = false;
  std::string worlds;  // folder with worlds of other projects; empty: none
  std::string only;  // of experiments with scenes: those whose "group name" or file contains this; empty: all
};

struct Experiment {
  std::string name;
  std::string about;  // one sentence

  // Call in a process that has loaded no engine, or the one for `options.precision`. Errors: CANCELLED, those
  // of the worlds.
  std::function<absl::StatusOr<Report>(const ExperimentOptions& options, const Progress& progress)> measure;

  bool has_scenes = false;  // ExperimentOptions::only chooses among them
  bool has_worlds = false;  // it runs the files of ExperimentOptions::worlds
};

const std::vector<Experiment>& all_experiments();

}  // namespace tessera
