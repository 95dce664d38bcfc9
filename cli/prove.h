// The proof behind a run: the same bits in one process, and what a plain Bullet world makes of it.
#pragma once

#include <absl/status/statusor.h>

#include "cli/run_report.h"

namespace tessera::cli {

struct Proof {
  RunReport in_process;
  RunReport plain;
};

// Repeats the run in two child processes (a process has one precision): in one process, unless that is what
// the run was, and in one plain Bullet world of single precision at absolute coordinates. Errors: what the
// children say; CANCELLED.
absl::StatusOr<Proof> prove(const RunOptions& options, const RunReport& run);

// Whether one process ended in the same bits.
bool holds(const Proof& proof, const RunReport& run);

std::string to_text(const Proof& proof, const RunReport& run);
nlohmann::json to_json(const Proof& proof, const RunReport& run);

}  // namespace tessera::cli
