// Metrics of this process from the operating system, under the standard names of Prometheus clients.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

namespace tessera {

std::vector<prometheus::MetricFamily> process_metrics();

}  // namespace tessera
