// Metric families of one sample, for metrics that are read from a state on request.
#pragma once

#include <prometheus/metric_family.h>

#include <string>
#include <utility>
#include <vector>

#include "lpss/model/tick_counts.h"

namespace tessera {

using MetricLabels = std::vector<prometheus::ClientMetric::Label>;

inline prometheus::MetricFamily gauge(std::string name, std::string help, double value,
                                      MetricLabels labels = {}) {
  prometheus::ClientMetric metric;
  metric.label = std::move(labels);
  metric.gauge.value = value;
  return {std::move(name), std::move(help), prometheus::MetricType::Gauge, {std::move(metric)}};
}

inline prometheus::MetricFamily counter(std::string name, std::string help, double value) {
  prometheus::ClientMetric metric;
  metric.counter.value = value;
  return {std::move(name), std::move(help), prometheus::MetricType::Counter, {std::move(metric)}};
}

// The metric that shows a counter of ticks: "tessera_world_clones", "tessera_world_diverged_total".
inline std::string metric_name(std::string prefix, const TickCounter& counter) {
  return std::move(prefix) + counter.name + (counter.over_ticks == OverTicks::kTotal ? "_total" : "");
}

inline std::string metric_help(const TickCounter& counter) {
  return std::string(counter.help) + (counter.over_ticks == OverTicks::kTotal ? "" : ", in the last tick");
}

}  // namespace tessera
