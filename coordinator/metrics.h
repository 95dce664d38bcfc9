// The coordinator's state as metrics, and whether it is ready for worlds.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <prometheus/metric_family.h>

#include <cstdint>
#include <string>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/request_queue.h"
#include "proto/server_traits.h"

namespace tessera {

// A snapshot taken by the coordinator's thread.
struct CoordinatorFigures {
  v1::StatusReply status;
  std::uint64_t ticks = 0;  // of the loaded world, with a duration
  double ticks_s = 0;       // the sum of their durations
  RoleWork::ByRole costs = {};
};

// Asks the thread that owns `coordinator` and takes from `queue`; for any other thread. UNAVAILABLE if it
// does not answer within a few seconds, or there is no coordinator, since this process stands by.
absl::StatusOr<CoordinatorFigures> ask_for_figures(RequestQueue& queue,
                                                   const Coordinator* const& coordinator);

std::vector<prometheus::MetricFamily> metrics_of(const CoordinatorFigures& figures,
                                                 const std::string& cluster);

// Of a process that stands by.
std::vector<prometheus::MetricFamily> standby_metrics(const std::string& cluster);

// UNAVAILABLE unless a world can be loaded: as many servers as a load needs (0: one) have joined, and none is
// a suspect.
absl::Status ready_for_worlds(const v1::StatusReply& status, std::uint32_t servers_wanted,
                              const Labels& required_labels);

}  // namespace tessera
