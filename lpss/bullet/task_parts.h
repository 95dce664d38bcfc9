// A task cut into parts that are solved in different ways: by joints, and by what the islands need.
#pragma once

#include <vector>

#include "lpss/engine/engine.h"

namespace tessera::bullet {

// Islands, each whole, with their contacts and joints. What is no dynamic body or clone of the task connects
// nothing.
struct TaskPart {
  bool has_joints = false;  // each of its islands
  int steps = 1;            // small steps of the tick, for each of its islands
  SolveTask task;           // in the order of the whole task
};

// At most one part for each way of solving. `task` must hold contacts whose worlds are not detecting.
std::vector<TaskPart> parts_of(const SolveTask& task, const EngineSettings& settings);

}  // namespace tessera::bullet
