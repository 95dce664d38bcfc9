#include "gateway/metrics.h"

#include "daemon/metric_families.h"

namespace tessera {
namespace {

// One sample a service.
prometheus::MetricFamily by_service(const Traffic& traffic, const std::string& name, const std::string& help,
                                    std::atomic<std::uint64_t> Traffic::Counts::*count) {
  prometheus::MetricFamily family{name, help, prometheus::MetricType::Counter, {}};
  for (const Traffic::Service service : {Traffic::kCoordinator, Traffic::kStreams}) {
    prometheus::ClientMetric metric;
    metric.label = {{"service", Traffic::kServices[service]}};
    metric.counter.value = static_cast<double>((traffic.of(service).*count).load());
    family.metric.push_back(std::move(metric));
  }
  return family;
}

}  // namespace

std::vector<prometheus::MetricFamily> metrics_of(const Traffic& traffic, bool leads,
                                                 const std::string& cluster) {
  return {
      gauge("tessera_gateway_info", "This gateway", 1, {{"cluster", cluster}}),
      gauge("tessera_gateway_coordinator", "1 while a coordinator is known that leads", leads ? 1 : 0),
      gauge("tessera_gateway_calls_under_way", "Calls and streams of clients",
            static_cast<double>(traffic.under_way())),
      gauge("tessera_gateway_clients", "Addresses that calls under way come from",
            static_cast<double>(traffic.clients())),
      counter("tessera_gateway_refused_total", "Calls beyond the limits",
              static_cast<double>(traffic.refused())),
      by_service(traffic, "tessera_gateway_calls_total", "Calls passed on, by service",
                 &Traffic::Counts::calls),
      by_service(traffic, "tessera_gateway_requests_total", "Messages of clients, by service",
                 &Traffic::Counts::requests),
      by_service(traffic, "tessera_gateway_request_bytes_total", "Their bytes",
                 &Traffic::Counts::request_bytes),
      by_service(traffic, "tessera_gateway_replies_total", "Messages to clients, by service",
                 &Traffic::Counts::replies),
      by_service(traffic, "tessera_gateway_reply_bytes_total", "Their bytes", &Traffic::Counts::reply_bytes),
  };
}

}  // namespace tessera
