// What the system knows of this process, under the names that Prometheus' clients use in every language.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

namespace tessera {

std::vector<prometheus::MetricFamily> process_metrics();

}  // namespace tessera
