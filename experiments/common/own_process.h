// Measures in a process of its own: a process can load one precision of the engine, and memory that one
// measurement took would count against the next.
#pragma once

#include <functional>

#include "experiments/common/report.h"

namespace tessera {

// What `measure` returns, from a copy of this process. Call before there are other threads. Errors: those of
// `measure`; INTERNAL where the process does not live to the end of it, RESOURCE_EXHAUSTED where there can be
// none.
absl::StatusOr<Report> in_own_process(const std::function<absl::StatusOr<Report>()>& measure);

}  // namespace tessera
