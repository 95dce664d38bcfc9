#include "coordinator/metrics.h"

#include <gmock/gmock.h>
#include <prometheus/text_serializer.h>

namespace tessera {
namespace {

using ::testing::HasSubstr;

CoordinatorFigures figures_of_a_run() {
  CoordinatorFigures figures{.ticks = 120, .ticks_s = 0.6};
  v1::StatusReply& status = figures.status;
  status.set_state("running");
  status.set_world("earth");
  status.set_tick(121);
  status.set_time(2.0);
  status.mutable_tick_ms()->set_p50(4);
  (*status.mutable_counts())["clones"] = 7;
  (*status.mutable_counts_since_load())["clones"] = 9;
  (*status.mutable_counts_since_load())["diverged"] = 3;
  status.add_servers()->set_takes_part(true);
  status.add_servers()->set_suspect(true);
  figures.costs[0] = {.requests = 9, .refused = 4, .work = std::chrono::milliseconds(1500)};
  return figures;
}

TEST(CoordinatorMetricsTest, SaysWhatTheStatusSays) {
  const std::string text = prometheus::TextSerializer().Serialize(metrics_of(figures_of_a_run(), "lab"));
  for (const char* line : {"tessera_coordinator_info{cluster=\"lab\"} 1\n",
                           "tessera_coordinator_servers 2\n",
                           "tessera_coordinator_servers_suspect 1\n",
                           "tessera_coordinator_servers_taking_part 1\n",
                           "tessera_world_state{state=\"running\"} 1\n",
                           "tessera_world_state{state=\"failed\"} 0\n",
                           "tessera_world_info{world=\"earth\"} 1\n",
                           "tessera_world_ticks_total 121\n",
                           "tessera_world_time_seconds_total 2\n",
                           "tessera_world_tick_duration_seconds_count 120\n",
                           "tessera_world_tick_duration_seconds{quantile=\"0.5\"} 0.004",
                           "tessera_world_clones 7\n",
                           "tessera_role_requests_total{role=\"observe\"} 9\n",
                           "tessera_role_refused_total{role=\"observe\"} 4\n",
                           "tessera_role_refused_total{role=\"admin\"} 0\n",
                           "tessera_role_work_seconds_total{role=\"observe\"} 1.5\n",
                           "# TYPE tessera_role_work_seconds_total counter\n",
                           "# TYPE tessera_world_clones gauge\n",
                           "tessera_world_diverged_total 3\n",
                           "# TYPE tessera_world_diverged_total counter\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST(CoordinatorMetricsTest, ReadyOnceEnoughServersAreThere) {
  v1::StatusReply status;
  EXPECT_THAT(ready_for_worlds(status, 0, {}).message(), HasSubstr("0 of 1"));
  status.add_servers();
  EXPECT_TRUE(ready_for_worlds(status, 0, {}).ok());
  EXPECT_THAT(ready_for_worlds(status, 2, {}).message(), HasSubstr("1 of 2"));
  status.add_servers()->set_suspect(true);
  EXPECT_FALSE(ready_for_worlds(status, 2, {}).ok());
  status.mutable_servers(1)->set_suspect(false);
  EXPECT_TRUE(ready_for_worlds(status, 2, {}).ok());
  status.mutable_servers(1)->add_labels("zone=eu");
  EXPECT_THAT(ready_for_worlds(status, 2, {"zone=eu"}).message(), HasSubstr("1 of 2"));
}

TEST(CoordinatorMetricsTest, QueueThatTakesNothingIsUnavailable) {
  RequestQueue queue([] {});
  queue.close();
  const Coordinator* const coordinator = nullptr;
  EXPECT_EQ(ask_for_figures(queue, coordinator).status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace tessera
