// Measures in a process of its own: a process can load one precision of the engine, and memory that one
// measurement took would count against the next.
#pragma once

#include <chrono>
#include <functional>

#include "cli/measure/report.h"

namespace tessera {

// Takes what a measurement has found until then.
using Keep = std::function<void(const Report& so_far)>;

// What a measurement has found, and how it ended. Where that is an error, `report` is what was kept until
// then.
struct Measured {
  Report report;
  absl::Status status;
};

// What `measure` returns, from a copy of this process, which ends with this one and at once where this one is
// interrupted (interrupt.h). Call before there are other threads. Errors: those of `measure`; CANCELLED by an
// interrupt; INTERNAL where the process does not live to the end of it, RESOURCE_EXHAUSTED where there can be
// none.
//
// With `processor_time_max`, a process that takes more is ended by a signal.
absl::StatusOr<Report> in_own_process(const std::function<absl::StatusOr<Report>()>& measure,
                                      std::chrono::seconds processor_time_max = std::chrono::seconds::max());

// The same for a measurement that hands over what it has found as often as it likes. `keep` takes a report
// only if it has more rows than the last one.
Measured in_own_process_keeping(const std::function<absl::StatusOr<Report>(const Keep& keep)>& measure,
                                std::chrono::seconds processor_time_max = std::chrono::seconds::max());

}  // namespace tessera
