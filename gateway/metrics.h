// Metrics of a gateway.
#pragma once

#include <prometheus/metric_family.h>

#include <string>
#include <vector>

#include "gateway/traffic.h"

namespace tessera {

// `leads`: a coordinator is known that does.
std::vector<prometheus::MetricFamily> metrics_of(const Traffic& traffic, bool leads,
                                                 const std::string& cluster);

}  // namespace tessera
