// Islands with joints apart from those without: the two are solved in different ways.
#pragma once

#include "lpss/engine/engine.h"

namespace tessera::bullet {

struct TaskParts {
  SolveTask jointed;  // all islands that a joint is in, with their contacts
  SolveTask loose;    // the others
};

// Both keep the order of the task. What is no dynamic body or clone of the task connects nothing.
TaskParts parts_of(const SolveTask& task);

}  // namespace tessera::bullet
