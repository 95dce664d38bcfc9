// The production state machines on a network with delays, reordering and cuts, with clients that change the
// world: the result is always the same bits, or an end with a message.
//
// Every run draws new seeds. If one fails, the test prints the command that repeats it; with TESSERA_SEED=N
// every test uses only seed N.
#include "simulator/simulated_cluster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "simulator/scenario.h"

namespace tessera {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Tick kTicks = 60;

class Seeds : public ::testing::Test {
 protected:
  Seeds() {
    if (const char* given = std::getenv("TESSERA_SEED")) {
      first_ = std::strtoull(given, nullptr, 10);
      is_given_ = true;
    } else {
      first_ = std::random_device()();
    }
    std::printf("seeds from %llu on\n", static_cast<unsigned long long>(first_));
  }

  // Calls `run` with `count` new seeds, or with the one in TESSERA_SEED; stops at the first failure.
  template <typename Run>
  void for_seeds(std::uint64_t count, const Run& run) {
    for (std::uint64_t n = 0; n < (is_given_ ? 1 : count) && !HasFatalFailure(); ++n) run(first_ + n);
  }

  std::uint64_t seed() const { return first_; }

 private:
  std::uint64_t first_ = 0;
  bool is_given_ = false;
};

// Runs scenarios like the given one, with other seeds, on 1 to 4 servers.
class Scenarios : public Seeds {
 protected:
  void expect_all_right(std::uint64_t count, Scenario scenario) {
    scenario.ticks = kTicks;
    for_seeds(count, [&](std::uint64_t seed) {
      scenario.seed = seed;
      scenario.servers = 1 + seed % 4;
      const absl::StatusOr<ScenarioReport> report = runner_.run(scenario);
      ASSERT_TRUE(report.ok()) << report.status() << "\nto repeat it: " << command_of(scenario);
    });
  }

  ScenarioRunner runner_{corner_pile()};
};

TEST_F(Scenarios, AnyDelayAndOrderOfMessagesEndsInTheSameBits) { expect_all_right(30, {}); }

TEST_F(Scenarios, CommandsOfClientsHaveTheSameBitsOnAnyServers) { expect_all_right(20, {.commands = 20}); }

TEST_F(Scenarios, CutsThatHealChangeNothingAndLongOnesEndTheWorld) {
  expect_all_right(20, {.commands = 10, .cuts = 3});
}

TEST_F(Scenarios, CrashesEndTheWorldWithAMessageAndHaveTheRightBitsUntilThen) {
  expect_all_right(20, {.commands = 10, .cuts = 1, .crashes = 1});
}

TEST_F(Scenarios, TheSameSeedIsTheSameRun) {
  for_seeds(3, [&](std::uint64_t seed) {
    const Scenario scenario{.seed = seed, .servers = 3, .ticks = kTicks, .commands = 10, .cuts = 2};
    const absl::StatusOr<ScenarioReport> first = runner_.run(scenario);
    const absl::StatusOr<ScenarioReport> again = runner_.run(scenario);
    ASSERT_TRUE(first.ok() && again.ok()) << command_of(scenario);
    EXPECT_EQ(first->events, again->events) << command_of(scenario);
    EXPECT_EQ(first->hash, again->hash) << command_of(scenario);
    EXPECT_EQ(first->failure, again->failure) << command_of(scenario);
  });
}

// A cluster of two servers whose world runs while one fault occurs.
class Faults : public Seeds {
 protected:
  void SetUp() override { ASSERT_TRUE(cluster_.load(corner_pile()).ok()); }

  // From the first ticks on.
  absl::Status step_through_cut(NodeId node, NodeId peer, seconds length) {
    const std::uint64_t begin_ns = 20'000'000;
    cluster_.meet({.cuts = {{node, peer, begin_ns, begin_ns + std::chrono::nanoseconds(length).count()}},
                   .crashes = {}});
    const absl::Status stepped = cluster_.step(kTicks).status();
    cluster_.outlast_faults();
    cluster_.run_events(100);  // messages that were held back arrive
    return stepped;
  }
  void expect_right_bits() {
    const auto hash = cluster_.hash();
    ASSERT_TRUE(hash.ok()) << hash.status();
    EXPECT_EQ(hash->hash(), *Checker(corner_pile()).untouched_hash(kTicks)) << "seed " << seed();
  }
  void expect_world_ended() {
    const auto status = cluster_.status();
    ASSERT_TRUE(status.ok()) << status.status();
    EXPECT_EQ(status->state(), "failed");
    EXPECT_THAT(status->failure(), HasSubstr(absl::StrCat("server ", absl::Hex(second_.value))));
    EXPECT_THAT(status->failure(), HasSubstr("silent for 10"));
  }

  SimulatedCluster cluster_{seed(), 2, Precision::kFloat32};
  NodeId first_ = cluster_.servers()[0];
  NodeId second_ = cluster_.servers()[1];
};

TEST_F(Faults, AServerThatIsCutOffForLessThanTheTimeoutIsTakenBack) {
  EXPECT_TRUE(step_through_cut(kCoordinatorNode, second_, seconds(8)).ok());
  EXPECT_GT(cluster_.network().now_ns(), 8'000'000'000u) << "the world waited for it";
  expect_right_bits();
}

TEST_F(Faults, ServersWaitForEachOtherHoweverLong) {
  EXPECT_TRUE(step_through_cut(first_, second_, seconds(100)).ok());
  EXPECT_GT(cluster_.network().now_ns(), 100'000'000'000u) << "the world waited for it";
  expect_right_bits();
}

TEST_F(Faults, AServerThatIsCutOffForLongerEndsTheWorldAndItself) {
  const absl::Status stepped = step_through_cut(kCoordinatorNode, second_, seconds(15));
  EXPECT_EQ(stepped.code(), absl::StatusCode::kUnavailable) << stepped;
  expect_world_ended();
  EXPECT_EQ(cluster_.end_of(first_), std::nullopt);
  ASSERT_TRUE(cluster_.end_of(second_).has_value());
  EXPECT_THAT(std::string(cluster_.end_of(second_)->message()), HasSubstr("did not respond"));
}

TEST_F(Faults, AKilledServerEndsTheWorldWithAMessage) {
  cluster_.network().kill(second_);
  const auto stepped = cluster_.step(100);
  EXPECT_EQ(stepped.status().code(), absl::StatusCode::kUnavailable) << stepped.status();
  expect_world_ended();
}

}  // namespace
}  // namespace tessera
