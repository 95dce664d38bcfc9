#include "coordinator/metrics.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <future>
#include <memory>
#include <utility>

#include "coordinator/tick_statistics.h"
#include "daemon/metric_families.h"
#include "proto/convert_counts.h"

namespace tessera {
namespace {

constexpr std::chrono::seconds kPatience(5);
constexpr std::array kStates = {"empty", "loading", "paused", "running", "recovering", "failed"};

prometheus::MetricFamily states(const std::string& state) {
  prometheus::MetricFamily family = {"tessera_world_state",
                                     "1 for the current state of the world, 0 for the others",
                                     prometheus::MetricType::Gauge,
                                     {}};
  for (const char* one : kStates) {
    prometheus::ClientMetric metric;
    metric.label = {{"state", one}};
    metric.gauge.value = state == one ? 1 : 0;
    family.metric.push_back(std::move(metric));
  }
  return family;
}

prometheus::MetricFamily leads(double leads) {
  return gauge("tessera_coordinator_leads", "1 while this coordinator leads, 0 while it stands by", leads);
}

// A counter with the label role.
prometheus::MetricFamily by_role(const RoleWork::ByRole& costs, std::string name, std::string help,
                                 double (*value)(const RoleWork::Costs&)) {
  prometheus::MetricFamily family = {std::move(name), std::move(help), prometheus::MetricType::Counter, {}};
  for (std::size_t role = 0; role < costs.size(); ++role) {
    prometheus::ClientMetric metric;
    metric.label = {{"role", std::string(name_of(static_cast<ClientRole>(role)))}};
    metric.counter.value = value(costs[role]);
    family.metric.push_back(std::move(metric));
  }
  return family;
}

prometheus::MetricFamily tick_durations(const CoordinatorFigures& figures) {
  prometheus::ClientMetric metric;
  metric.summary = {.sample_count = figures.ticks,
                    .sample_sum = figures.ticks_s,
                    .quantile = {{0.5, figures.status.tick_ms().p50() / 1e3},
                                 {0.99, figures.status.tick_ms().p99() / 1e3},
                                 {1, figures.status.tick_ms().max() / 1e3}}};
  return {"tessera_world_tick_duration_seconds",
          "Duration of ticks of the loaded world on the slowest server, without pacing",
          prometheus::MetricType::Summary,
          {std::move(metric)}};
}

}  // namespace

absl::StatusOr<CoordinatorFigures> ask_for_figures(RequestQueue& queue,
                                                   const Coordinator* const& coordinator) {
  const auto promise = std::make_shared<std::promise<absl::StatusOr<CoordinatorFigures>>>();
  std::future<absl::StatusOr<CoordinatorFigures>> answer = promise->get_future();
  using StatusCall = ClientCall<v1::StatusRequest, v1::StatusReply>;
  ClientRequest request =
      StatusCall{{}, [promise, &coordinator](const absl::Status& status, const v1::StatusReply& reply) {
                   if (!status.ok()) {
                     promise->set_value(status);
                     return;
                   }
                   CoordinatorFigures figures{.status = reply};
                   if (const DurationHistogram* durations = coordinator->tick_durations()) {
                     figures.ticks = durations->count();
                     figures.ticks_s = durations->sum_s();
                   }
                   figures.costs = coordinator->costs_by_role();
                   promise->set_value(std::move(figures));
                 }};
  if (!queue.push(request, 0).ok() || answer.wait_for(kPatience) != std::future_status::ready) {
    return absl::UnavailableError("the coordinator does not answer: it is busy or shutting down");
  }
  return answer.get();
}

std::vector<prometheus::MetricFamily> metrics_of(const CoordinatorFigures& figures,
                                                 const std::string& cluster) {
  const v1::StatusReply& status = figures.status;
  const auto suspects = std::count_if(status.servers().begin(), status.servers().end(),
                                      [](const v1::ServerStatus& server) { return server.suspect(); });
  const auto taking_part = std::count_if(status.servers().begin(), status.servers().end(),
                                         [](const v1::ServerStatus& server) { return server.takes_part(); });
  const auto slow = std::count_if(status.servers().begin(), status.servers().end(),
                                  [](const v1::ServerStatus& server) { return server.slow(); });
  const auto number = [](auto value) { return static_cast<double>(value); };
  std::vector<prometheus::MetricFamily> families = {
      gauge("tessera_coordinator_info", "The cluster of this coordinator", 1, {{"cluster", cluster}}),
      leads(1),
      gauge("tessera_coordinator_servers", "Sector servers that have joined", number(status.servers_size())),
      gauge("tessera_coordinator_servers_suspect", "Joined servers that do not respond", number(suspects)),
      gauge("tessera_coordinator_servers_taking_part", "Servers that host the loaded world",
            number(taking_part)),
      states(status.state()),
      gauge("tessera_world_info", "The loaded world", 1, {{"world", status.world()}}),
      counter("tessera_world_ticks_total", "Ticks of the loaded world that all servers have completed",
              number(status.tick())),
      counter("tessera_world_time_seconds_total", "Simulated time of the loaded world", status.time()),
      gauge("tessera_world_real_time_ratio", "Simulated time per wall time", status.real_time_factor()),
      tick_durations(figures),
      by_role(figures.costs, "tessera_role_requests_total", "Requests of clients, by their role",
              [](const RoleWork::Costs& costs) { return static_cast<double>(costs.requests); }),
      by_role(figures.costs, "tessera_role_refused_total",
              "Requests that were refused since they would have taken too much time or memory",
              [](const RoleWork::Costs& costs) { return static_cast<double>(costs.refused); }),
      by_role(figures.costs, "tessera_role_work_seconds_total",
              "Time that requests took of the coordinator and of the server that took longest",
              [](const RoleWork::Costs& costs) { return std::chrono::duration<double>(costs.work).count(); }),
      gauge("tessera_world_bodies", "Bodies of the loaded world", number(status.bodies())),

      counter("tessera_world_recoveries_total",
              "How often the world went on from a checkpoint, on other servers", number(status.recoveries())),
      counter("tessera_world_servers_cut_off_total",
              "Servers that the world went on without, since others did not hear them",
              number(status.cut_off_servers())),
      gauge("tessera_coordinator_servers_slow", "Servers for which the others wait most of each tick",
            number(slow)),
      gauge("tessera_store_failing", "1 while the store cannot be written",
            status.store_failure().empty() ? 0 : 1),
      gauge("tessera_store_waiting", "1 while the world waits until it can be",
            status.waits_for_store() ? 1 : 0),
      gauge("tessera_world_map_epoch", "How often the sector map has changed", number(status.map_epoch())),
  };
  const TickCounts last = counts_from(status.counts());
  const TickCounts since_load = counts_from(status.counts_since_load());
  for (const TickCounter& count : kTickCounters) {
    const std::string name = metric_name("tessera_world_", count);
    families.push_back(count.over_ticks == OverTicks::kTotal
                           ? counter(name, metric_help(count), number(since_load.*count.value))
                           : gauge(name, metric_help(count), number(last.*count.value)));
  }
  return families;
}

std::vector<prometheus::MetricFamily> standby_metrics(const std::string& cluster) {
  return {gauge("tessera_coordinator_info", "The cluster of this coordinator", 1, {{"cluster", cluster}}),
          leads(0)};
}

absl::Status ready_for_worlds(const v1::StatusReply& status, std::uint32_t servers_wanted,
                              const Labels& required_labels) {
  const auto is_fit = [&](const v1::ServerStatus& server) {
    return !server.suspect() && has_all({server.labels().begin(), server.labels().end()}, required_labels);
  };
  const auto heard = std::ranges::count_if(status.servers(), is_fit);
  const std::uint32_t wanted = std::max(servers_wanted, 1u);
  if (heard >= wanted) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(heard, " of ", wanted, " sector servers have joined"));
}

}  // namespace tessera
