// Divides a task into parts with different numbers of substeps, according to the needs of the islands.
#pragma once

#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/native/contact_needs.h"

namespace tessera::native {

// Islands, each whole, with their contacts and joints. Only dynamic bodies and clones of the task
// connect islands.
struct TaskPart {
  int steps = 1;   // substeps of the tick, for each of its islands
  SolveTask task;  // in the order of the whole task
};

// Of a tick of `dt` seconds: at most one part for each number of steps. The bodies of the task and their
// clones know their places in it (Body::place).
std::vector<TaskPart> parts_of(const SolveTask& task, const ContactNeeds& needs, double dt);

}  // namespace tessera::native
