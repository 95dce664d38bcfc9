#include "daemon/monitor.h"

#include <gmock/gmock.h>

#include "daemon/metric_families.h"
#include "daemon/test_http.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

Monitored all_well() {
  return {.metrics =
              [] {
                return std::vector{gauge("tessera_test", "Of this test", 3, {{"of", "it"}})};
              },
          .alive = [] { return absl::OkStatus(); },
          .ready = [] { return absl::OkStatus(); }};
}

TEST(MonitorTest, ServesMetricsAndHealth) {
  const auto monitor = Monitor::open("127.0.0.1:0", std::nullopt, all_well());
  ASSERT_TRUE(monitor.ok()) << monitor.status();
  const std::string& address = (*monitor)->address();
  const HttpAnswer metrics = http_get(address, "/metrics");
  EXPECT_EQ(metrics.code, 200);
  EXPECT_THAT(metrics.body, HasSubstr("# TYPE tessera_test gauge\ntessera_test{of=\"it\"} 3\n"));
  EXPECT_THAT(metrics.body, HasSubstr("process_resident_memory_bytes "));
  EXPECT_THAT(metrics.body, HasSubstr("tessera_build_info{version=\""));
  EXPECT_EQ(http_get(address, "/healthz").code, 200);
  EXPECT_EQ(http_get(address, "/readyz").code, 200);
  EXPECT_EQ(http_get(address, "/other").code, 404);
}

TEST(MonitorTest, SaysWhyNot) {
  Monitored monitored = all_well();
  monitored.ready = [] { return absl::UnavailableError("no coordinator"); };
  monitored.metrics = [] { return absl::UnavailableError("busy"); };
  const auto monitor = Monitor::open("127.0.0.1:0", std::nullopt, monitored);
  ASSERT_TRUE(monitor.ok()) << monitor.status();
  const HttpAnswer ready = http_get((*monitor)->address(), "/readyz");
  EXPECT_EQ(ready.code, 503);
  EXPECT_EQ(ready.body, "no coordinator\n");
  EXPECT_EQ(http_get((*monitor)->address(), "/metrics").code, 503);
  EXPECT_EQ(http_get((*monitor)->address(), "/healthz").code, 200);
}

TEST(MonitorTest, SeveralGetPortsOfTheirOwnAndNoneIsSharedUnnoticed) {
  const auto first = Monitor::open("127.0.0.1:0", std::nullopt, all_well());
  const auto second = Monitor::open("127.0.0.1:0", std::nullopt, all_well());
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_NE((*first)->address(), (*second)->address());
  const absl::Status taken = Monitor::open((*first)->address(), std::nullopt, all_well()).status();
  EXPECT_EQ(taken.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(taken.message()), HasSubstr((*first)->address()));
}

TEST(MonitorTest, AddressesThatAreNoneAreNamed) {
  for (const char* address : {"", "9464", "localhost", ":9464", "127.0.0.1:65536", "127.0.0.1:1,8080"}) {
    EXPECT_EQ(Monitor::open(address, std::nullopt, all_well()).status().code(),
              absl::StatusCode::kInvalidArgument)
        << address;
  }
}

TEST(PulseTest, BeatsAtFirst) { EXPECT_TRUE(Pulse().alive().ok()); }

}  // namespace
}  // namespace tessera
