// Metrics, health and logs of running daemons.
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <span>
#include <sstream>

#include "daemon/test_http.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

constexpr const char* kCoordinatorMetrics[] = {"tessera_build_info",
                                               "tessera_coordinator_info",
                                               "tessera_coordinator_leads",
                                               "tessera_coordinator_servers",
                                               "tessera_coordinator_servers_suspect",
                                               "tessera_coordinator_servers_taking_part",
                                               "tessera_coordinator_servers_slow",
                                               "tessera_store_failing",
                                               "tessera_store_waiting",
                                               "tessera_role_requests_total",
                                               "tessera_role_refused_total",
                                               "tessera_role_work_seconds_total",
                                               "tessera_world_state",
                                               "tessera_world_info",
                                               "tessera_world_ticks_total",
                                               "tessera_world_time_seconds_total",
                                               "tessera_world_real_time_ratio",
                                               "tessera_world_tick_duration_seconds",
                                               "tessera_world_bodies",
                                               "tessera_world_map_epoch",
                                               "tessera_world_recoveries_total",
                                               "tessera_world_servers_cut_off_total",
                                               "process_cpu_seconds_total",
                                               "process_resident_memory_bytes",
                                               "process_resident_memory_max_bytes",
                                               "process_start_time_seconds"};

constexpr const char* kServerMetrics[] = {"tessera_build_info",
                                          "tessera_server_info",
                                          "tessera_server_threads",
                                          "tessera_server_joined",
                                          "tessera_server_tick",
                                          "tessera_server_ticks_total",
                                          "tessera_server_tick_duration_seconds",
                                          "tessera_server_own_seconds_total",
                                          "tessera_server_bodies",
                                          "tessera_server_exchange_bytes_total",
                                          "tessera_server_round_messages_total",
                                          "tessera_server_round_bytes_total",
                                          "tessera_server_ground_tiles",
                                          "tessera_server_ground_bytes",
                                          "tessera_server_ground_waits_total",
                                          "process_cpu_seconds_total",
                                          "process_resident_memory_bytes",
                                          "process_resident_memory_max_bytes",
                                          "process_start_time_seconds"};

// Including the counters of ticks.
std::vector<std::string> with_counters(std::span<const char* const> names, const std::string& prefix) {
  std::vector<std::string> all(names.begin(), names.end());
  for (const TickCounter& counter : kTickCounters) {
    const char* suffix = counter.over_ticks == OverTicks::kTotal ? "_total" : "";
    all.push_back(absl::StrCat(prefix, counter.name, suffix));
  }
  return all;
}
std::vector<std::string> coordinator_metrics() {
  return with_counters(kCoordinatorMetrics, "tessera_world_");
}
std::vector<std::string> server_metrics() { return with_counters(kServerMetrics, "tessera_server_"); }

// A scrape, checked for Prometheus' text format and naming rules while it is parsed.
class Scrape {
 public:
  explicit Scrape(const std::string& text) {
    EXPECT_TRUE(absl::EndsWith(text, "\n"));
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) read(line);
    for (const auto& [name, type] : types_) check(name, type);
  }

  std::set<std::string> names() const {
    std::set<std::string> names;
    for (const auto& [name, type] : types_) names.insert(name);
    return names;
  }
  double value(const std::string& sample) const {
    const auto found = samples_.find(sample);
    EXPECT_NE(found, samples_.end()) << sample;
    return found == samples_.end() ? -1 : found->second;
  }

 private:
  void read(const std::string& line) {
    static const std::regex comment(R"(# (HELP|TYPE) ([a-zA-Z_:][a-zA-Z0-9_:]*) (.+))");
    static const std::regex sample(
        R"(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{[a-zA-Z_][a-zA-Z0-9_]*="[^"]*"(,[a-zA-Z_][a-zA-Z0-9_]*="[^"]*")*\})? (\S+))");
    std::smatch match;
    if (std::regex_match(line, match, comment)) {
      if (match[1] == "HELP") {
        helped_.insert(match[2]);
      } else {
        EXPECT_TRUE(types_.emplace(match[2], match[3]).second) << "two types: " << line;
        EXPECT_TRUE(helped_.contains(match[2])) << "no help: " << line;
      }
      return;
    }
    ASSERT_TRUE(std::regex_match(line, match, sample)) << line;
    const std::string name = match[1];
    const std::string family = types_.contains(name) ? name : name.substr(0, name.rfind('_'));
    EXPECT_TRUE(types_.contains(family)) << "no type: " << line;
    double value = 0;
    EXPECT_TRUE(absl::SimpleAtod(match[4].str(), &value)) << line;
    EXPECT_TRUE(samples_.emplace(name + match[2].str(), value).second) << "twice: " << line;
  }

  void check(const std::string& name, const std::string& type) const {
    EXPECT_EQ(type == "counter", absl::EndsWith(name, "_total")) << name << " is a " << type;
    for (const char* unit : {"_ms", "_us", "_milliseconds", "_kilobytes", "_mb", "_percent"}) {
      EXPECT_FALSE(absl::StrContains(name, unit)) << name << ": units are seconds, bytes and ratios";
    }
    if (type != "histogram") return;
    double before = 0;
    for (const auto& [sample, count] : buckets(name)) {
      EXPECT_GE(count, before) << sample;
      before = count;
    }
    EXPECT_EQ(before, value(name + "_count")) << name;
  }
  // By bound.
  std::map<double, double> buckets(const std::string& name) const {
    std::map<double, double> result;
    const std::string start = name + "_bucket{le=\"";
    for (auto it = samples_.lower_bound(start); it != samples_.end() && absl::StartsWith(it->first, start);
         ++it) {
      double bound = 0;
      EXPECT_TRUE(absl::SimpleAtod(
          it->first.substr(start.size(), it->first.find('"', start.size()) - start.size()), &bound));
      result[bound] = it->second;
    }
    return result;
  }

  std::set<std::string> helped_;
  std::map<std::string, std::string> types_;
  std::map<std::string, double> samples_;
};

// The text after `before` in the daemon's output, up to the next of these characters.
std::string said(Process& daemon, const std::string& before, const char* end) {
  EXPECT_TRUE(daemon.await_output(before)) << daemon.output();
  const std::string output = daemon.output();
  const std::size_t begin = output.find(before) + before.size();
  return output.substr(begin, output.find_first_of(end, begin) - begin);
}

class MetricsTest : public ::testing::Test {
 protected:
  std::unique_ptr<Process> start(const std::string& name, std::vector<std::string> more) {
    for (const std::string& argument :
         {std::string("--cluster"), "metrics-" + std::to_string(getpid()), std::string("--domain"),
          std::to_string(1 + getpid() % 99), std::string("--listen"), std::string("127.0.0.1:0"),
          std::string("--metrics-address"), std::string("127.0.0.1:0"), std::string("--log-format"),
          std::string("json"), std::string("--exit-with-parent")}) {
      more.push_back(argument);
    }
    return std::make_unique<Process>(name, more);
  }
  void start_servers() {
    for (int i = 0; i < 2; ++i) servers_.push_back(start("tessera-sector-server", {"--threads", "1"}));
    for (const auto& server : servers_) {
      ASSERT_TRUE(server->await_output("has accepted this server")) << server->output();
    }
  }
  static std::string monitor_of(Process& daemon) { return said(daemon, "metrics on http://", "/"); }
  static Scrape scrape(Process& daemon) { return Scrape(http_get(monitor_of(daemon), "/metrics").body); }

  std::unique_ptr<Process> coordinator_ = start("tessera-coordinator", {"--servers", "2"});
  std::vector<std::unique_ptr<Process>> servers_;
};

TEST_F(MetricsTest, DaemonsSayWhetherTheyAreReadyAndWhatTheyDo) {
  const std::string monitor = monitor_of(*coordinator_);
  const HttpAnswer early = http_get(monitor, "/readyz");
  EXPECT_EQ(early.code, 503);
  EXPECT_THAT(early.body, HasSubstr("0 of 2 sector servers"));
  EXPECT_EQ(http_get(monitor, "/healthz").code, 200);
  start_servers();
  EXPECT_EQ(http_get(monitor, "/readyz").code, 200);
  EXPECT_NE(monitor_of(*servers_[0]), monitor_of(*servers_[1]));

  const auto client = Client::connect(said(*coordinator_, "clients on ", "\""), kPatience);
  ASSERT_THAT(client.status(), IsOk());
  ASSERT_THAT((*client)->load(read_world("seam.sdf")).status(), IsOk());
  ASSERT_THAT((*client)->step(30, kPatience).status(), IsOk());
  const ClusterStatus status = (*client)->status().value();

  const Scrape world = scrape(*coordinator_);
  EXPECT_THAT(world.names(), ::testing::UnorderedElementsAreArray(coordinator_metrics()));
  EXPECT_EQ(world.value("tessera_coordinator_servers"), 2);
  EXPECT_EQ(world.value("tessera_world_ticks_total"), 30);
  EXPECT_EQ(world.value("tessera_world_time_seconds_total"), 0.5);
  EXPECT_EQ(world.value("tessera_world_tick_duration_seconds_count"), 30);
  EXPECT_GT(world.value("tessera_world_tick_duration_seconds_sum"), 0);
  EXPECT_EQ(world.value("tessera_world_state{state=\"paused\"}"), 1);
  EXPECT_EQ(world.value("tessera_world_bodies"), static_cast<double>(status.bodies));
  EXPECT_EQ(world.value("tessera_world_contacts"), static_cast<double>(status.counts.contacts));
  EXPECT_GT(status.counts.contacts, 0u);

  double awake = 0;
  double exchanged = 0;
  for (const auto& server : servers_) {
    EXPECT_EQ(http_get(monitor_of(*server), "/healthz").code, 200);
    EXPECT_EQ(http_get(monitor_of(*server), "/readyz").code, 200);
    const Scrape share = scrape(*server);
    EXPECT_THAT(share.names(), ::testing::UnorderedElementsAreArray(server_metrics()));
    EXPECT_EQ(share.value("tessera_server_ticks_total"), 30);
    EXPECT_EQ(share.value("tessera_server_tick"), 30);
    EXPECT_EQ(share.value("tessera_server_tick_duration_seconds_count"), 30);
    EXPECT_EQ(share.value("tessera_server_joined"), 1);
    EXPECT_GT(share.value("process_resident_memory_bytes"), 1e6);
    awake += share.value("tessera_server_bodies_awake");
    exchanged += share.value("tessera_server_exchange_bytes_total");
  }
  EXPECT_EQ(awake, world.value("tessera_world_bodies_awake"));
  EXPECT_GT(exchanged, 0);
}

TEST_F(MetricsTest, LogsAreObjectsWithTheTickWhereThereIsOne) {
  start_servers();
  const auto client = Client::connect(said(*coordinator_, "clients on ", "\""), kPatience);
  ASSERT_THAT(client.status(), IsOk());
  ASSERT_THAT((*client)->load(read_world("falling.sdf")).status(), IsOk());
  ASSERT_THAT((*client)->step(3, kPatience).status(), IsOk());
  ASSERT_THAT((*client)->unload(), IsOk());
  ASSERT_THAT((*client)->shutdown(), IsOk());
  EXPECT_EQ(coordinator_->wait(), 0);
  std::map<std::string, nlohmann::json> by_message;
  for (const absl::string_view line : absl::StrSplit(coordinator_->output(), '\n', absl::SkipEmpty())) {
    const nlohmann::json object = nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false);
    ASSERT_TRUE(object.is_object()) << line;
    EXPECT_EQ(object["daemon"], "coordinator");
    by_message[object["message"]] = object;
  }
  EXPECT_EQ(by_message["the world 'falling' is loaded"]["tick"], 0);
  EXPECT_EQ(by_message["the world 'falling' is unloaded"]["tick"], 3);
  for (const auto& server : servers_) EXPECT_EQ(server->wait(), 0) << server->output();
}

TEST_F(MetricsTest, AddressThatIsTakenIsNamed) {
  const std::string taken = monitor_of(*coordinator_);
  Process late("tessera-sector-server", {"--metrics-address", taken, "--domain", "99", "--cluster", "none"});
  EXPECT_EQ(late.wait(), 1);
  EXPECT_THAT(late.output(), HasSubstr(taken));
}

// Names in other files that must follow the daemons.
TEST(MetricNamesTest, DashboardAndDocumentationKnowThem) {
  std::set<std::string> known;
  for (const std::string& name : coordinator_metrics()) known.insert(name);
  for (const std::string& name : server_metrics()) known.insert(name);
  const auto text_of = [](const char* file) {
    std::ifstream in(std::filesystem::path(TESSERA_SOURCE) / file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string documentation = text_of("docs/counters.md");
  for (const std::string& name : known) EXPECT_THAT(documentation, HasSubstr("`" + name));

  const std::string dashboard = text_of("deploy/grafana/tessera.json");
  EXPECT_TRUE(nlohmann::json::accept(dashboard));
  const std::regex metric("(tessera_|process_)[a-z_]+");
  std::size_t used = 0;
  for (std::sregex_iterator it(dashboard.begin(), dashboard.end(), metric), end; it != end; ++it, ++used) {
    const std::string name = std::regex_replace(it->str(), std::regex("_(bucket|sum|count)$"), "");
    EXPECT_TRUE(known.contains(name)) << name;
  }
  EXPECT_GT(used, 10u);
}

}  // namespace
}  // namespace tessera
