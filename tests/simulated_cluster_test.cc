// The production state machines and store on a network, clocks and a disk with faults, with clients that
// change the world, and with processes that end: the result is always the same bits.
//
// Every run draws new seeds where messages are delayed and cut off, where processes end, and where everything
// happens at once; of single kinds of other faults it runs the same few. If a seed fails, the test prints the
// command that repeats it; with TESSERA_SEED=N every test uses only seed N.
#include "simulator/simulated_cluster.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "lpss/base/invariant.h"
#include "lpss/programs/module.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/simulation/test_runs.h"
#include "simulator/scenario.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

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

  // Likewise, with the seeds from 1 on in place of new ones.
  template <typename Run>
  void for_same_seeds(std::uint64_t count, const Run& run) {
    if (!is_given_) first_ = 1;
    for_seeds(count, run);
  }

  std::uint64_t seed() const { return first_; }

 private:
  std::uint64_t first_ = 0;
  bool is_given_ = false;
};

FaultNumbers some(std::initializer_list<std::pair<FaultKind, std::uint32_t>> kinds) {
  FaultNumbers numbers{};
  for (const auto& [kind, number] : kinds) numbers[static_cast<std::size_t>(kind)] = number;
  return numbers;
}

// Runs scenarios like the given one, with other seeds, on 1 to 4 servers, or on 4 to 12 with links.
class Scenarios : public Seeds {
 protected:
  explicit Scenarios(WorldDescription world = corner_pile()) : runner_(std::move(world)) {}

  void expect_all_right(std::uint64_t count, const Scenario& scenario) {
    for_seeds(count, [&](std::uint64_t seed) { expect_right(seed, scenario); });
  }
  void expect_same_right(std::uint64_t count, const Scenario& scenario) {
    for_same_seeds(count, [&](std::uint64_t seed) { expect_right(seed, scenario); });
  }

  ScenarioRunner runner_;

 private:
  void expect_right(std::uint64_t seed, Scenario scenario) {
    scenario.ticks = kTicks;
    scenario.seed = seed;
    scenario.servers = scenario.links ? static_cast<std::uint32_t>(4 + seed % 9) : 1 + seed % 4;
    const absl::StatusOr<ScenarioReport> report = runner_.run(scenario);
    ASSERT_TRUE(report.ok()) << report.status() << "\nto repeat it: " << command_of(scenario);
  }
};

TEST_F(Scenarios, AnyDelayAndOrderOfMessagesEndsInTheSameBits) { expect_all_right(30, {}); }

TEST_F(Scenarios, CommandsOfClientsHaveTheSameBitsOnAnyServers) { expect_all_right(20, {.commands = 20}); }

TEST_F(Scenarios, NorDoCommandsAndQueriesOfEveryKind) {
  expect_same_right(10, {.commands = 40, .extremes = true});
}

TEST_F(Scenarios, NorDoTheyInTheMidstOfEverything) {
  Scenario scenario{.commands = 30, .extremes = true};
  scenario.faults.fill(1);
  expect_same_right(10, scenario);
}

TEST_F(Scenarios, CutsOfAnyLengthChangeNothing) {
  expect_all_right(20, {.commands = 10, .faults = some({{FaultKind::kCut, 3}})});
}

TEST_F(Scenarios, CutsForGoodChangeNothing) {
  expect_all_right(30, {.commands = 10, .faults = some({{FaultKind::kLastingCut, 1}})});
  expect_all_right(20, {.commands = 10, .faults = some({{FaultKind::kLastingCut, 3}})});
  expect_all_right(10, {.links = true, .commands = 10, .faults = some({{FaultKind::kLastingCut, 3}})});
}

TEST_F(Scenarios, NorDoTheyInTheMidstOfFaults) {
  expect_all_right(20, {.commands = 10,
                        .faults = some({{FaultKind::kLastingCut, 2},
                                        {FaultKind::kCut, 1},
                                        {FaultKind::kStop, 1},
                                        {FaultKind::kCrash, 1},
                                        {FaultKind::kCoordinatorCrash, 1},
                                        {FaultKind::kJoin, 1},
                                        {FaultKind::kDrain, 1}})});
}

TEST_F(Scenarios, CrashesChangeNothing) {
  expect_all_right(40, {.commands = 10, .faults = some({{FaultKind::kCut, 1}, {FaultKind::kCrash, 2}})});
}

TEST_F(Scenarios, NorDoesTheLossOfMostServers) {
  expect_all_right(20, {.commands = 10, .faults = some({{FaultKind::kCrash, 6}})});
}

// A crowd, and balls that flee it by a program in WebAssembly.
WorldDescription crowd_with_balls() {
  constexpr int kBalls = 8;
  const auto module = load_module_file(TESSERA_OWN_WORLDS "/programs/flee.wasm");
  invariant(module.ok(), "the module of worlds/flee.sdf can be read");
  WorldSettings settings = sectors_of(8);
  settings.modules = {*module};
  WorldBuilder builder(settings);
  builder.world() = crowd_world(settings);
  const ShapeId ball = builder.shape(Sphere{0.3});
  for (int n = 0; n < kBalls; ++n) {
    const double hunter = 3 + 2 * n;  // the floor and the lift are first
    builder.add(absl::StrCat("ball", n), ball, 2, {2.0 * n - 7, 5.0 - 3 * (n % 3), 0.3})
        .programs.push_back(example_program("flee", {{"from", hunter}}));
  }
  return builder.world();
}

// Programs are as safe from loss as bodies. Clients spawn bodies with programs of every kind, and tell them.
class ProgramScenarios : public Scenarios {
 protected:
  ProgramScenarios() : Scenarios(crowd_with_balls()) {}
};

TEST_F(ProgramScenarios, FaultsChangeNothing) {
  expect_all_right(290, {.commands = 20,
                         .faults = some({{FaultKind::kLastingCut, 1},
                                         {FaultKind::kCut, 1},
                                         {FaultKind::kCrash, 1},
                                         {FaultKind::kCoordinatorCrash, 1},
                                         {FaultKind::kJoin, 1},
                                         {FaultKind::kDrain, 1}})});
  expect_all_right(10, {.links = true, .commands = 10, .faults = some({{FaultKind::kCrash, 1}})});
}

// Clients bring the module of those balls to a crowd that begins without it.
class LateModuleScenarios : public Scenarios {
 protected:
  LateModuleScenarios() : Scenarios(crowd_world(sectors_of(8))) {}
};

TEST_F(LateModuleScenarios, FaultsChangeNothing) {
  expect_all_right(30, {.commands = 20,
                        .faults = some({{FaultKind::kCut, 1},
                                        {FaultKind::kCrash, 2},
                                        {FaultKind::kCoordinatorCrash, 1},
                                        {FaultKind::kJoin, 1},
                                        {FaultKind::kDrain, 1}})});
}

// A difference that no body shows is found, at its tick.
TEST(ProgramHashes, AreComparedAfterEveryTick) {
  std::vector<v1::RecordedInput> log;
  SimulatedCluster cluster(1, 2, Precision::kFloat32, {.inputs = [&](const v1::RecordedInput& input) {
                             if (input.has_hash()) log.push_back(input);
                           }});
  ASSERT_TRUE(cluster.load(crowd_with_balls()).ok());
  ASSERT_TRUE(cluster.step(5).ok());
  ASSERT_TRUE(cluster.hash().ok());  // by then, that of the last tick has arrived
  ASSERT_EQ(log.size(), 5u);
  Checker checker(crowd_with_balls());
  EXPECT_TRUE(checker.check(log).ok()) << checker.check(log);
  log[2].mutable_hash()->set_programs(std::string(32, '0'));
  EXPECT_THAT(
      std::string(checker.check(log).message()),
      ::testing::StartsWith("tick 3: the cluster has the hash 00000000000000000000000000000000 of programs"));
}

TEST_F(ProgramScenarios, NorDoRequestsOfEveryKind) {
  expect_same_right(20, {.commands = 40, .extremes = true, .faults = some({{FaultKind::kCrash, 1}})});
}

TEST_F(Scenarios, CrashesOfTheCoordinatorChangeNothing) {
  expect_all_right(40, {.commands = 10, .faults = some({{FaultKind::kCoordinatorCrash, 2}})});
}

TEST_F(Scenarios, NorDoesAllOfThisAtOnce) {
  expect_all_right(
      80,
      {.commands = 20,
       .faults = some({{FaultKind::kCut, 2}, {FaultKind::kCrash, 2}, {FaultKind::kCoordinatorCrash, 2}})});
}

TEST_F(Scenarios, ServersThatTalkToThoseAroundThemAloneHaveTheSameBits) {
  expect_all_right(
      20,
      {.links = true,
       .commands = 20,
       .faults = some({{FaultKind::kCut, 2}, {FaultKind::kCrash, 2}, {FaultKind::kCoordinatorCrash, 1}})});
}

TEST_F(Scenarios, BrokenConnectionsChangeNothing) {
  expect_same_right(8, {.commands = 10, .faults = some({{FaultKind::kCut, 3}, {FaultKind::kBreak, 5}})});
}

TEST_F(Scenarios, NorDoCrashesWhileTheWorldGoesOnFromACheckpoint) {
  expect_same_right(
      8, {.commands = 10, .faults = some({{FaultKind::kCrash, 2}, {FaultKind::kCrashInRecovery, 3}})});
}

TEST_F(Scenarios, NorDoesTheLossOfThePowerOfTheCoordinator) {
  expect_same_right(8, {.commands = 20, .faults = some({{FaultKind::kPowerLoss, 3}})});
}

TEST_F(Scenarios, WhileItsDiskIsFullOrFailsTheWorldWaits) {
  expect_same_right(
      8, {.commands = 20,
          .faults =
              some({{FaultKind::kDiskFull, 2}, {FaultKind::kDiskFailing, 2}, {FaultKind::kPowerLoss, 1}})});
}

TEST_F(Scenarios, ProcessesThatStandStillAndClocksThatJumpChangeNothing) {
  expect_same_right(8, {.commands = 10,
                        .faults = some({{FaultKind::kStop, 3},
                                        {FaultKind::kSlow, 2},
                                        {FaultKind::kClockJump, 3},
                                        {FaultKind::kCoordinatorCrash, 1}})});
}

TEST_F(Scenarios, NorDoesAnythingAtOnce) {
  Scenario scenario{.commands = 20};
  scenario.faults.fill(1);
  expect_all_right(50, scenario);
}

TEST_F(Scenarios, NorDoServersThatJoinAndLeave) {
  expect_all_right(20, {.commands = 20, .faults = some({{FaultKind::kJoin, 2}, {FaultKind::kDrain, 2}})});
}

TEST_F(Scenarios, NorDoThoseThatDoSoInTheMidstOfFaults) {
  expect_all_right(20, {.commands = 20,
                        .faults = some({{FaultKind::kJoin, 2},
                                        {FaultKind::kDrain, 2},
                                        {FaultKind::kCut, 1},
                                        {FaultKind::kStop, 1},
                                        {FaultKind::kCrash, 1},
                                        {FaultKind::kCrashInRecovery, 1},
                                        {FaultKind::kCoordinatorCrash, 1},
                                        {FaultKind::kPowerLoss, 1}})});
}

TEST_F(Scenarios, TheSameSeedIsTheSameRun) {
  for_same_seeds(3, [&](std::uint64_t seed) {
    Scenario scenario{.seed = seed, .servers = 3, .ticks = kTicks, .commands = 10};
    scenario.faults.fill(1);
    const absl::StatusOr<ScenarioReport> first = runner_.run(scenario);
    const absl::StatusOr<ScenarioReport> again = runner_.run(scenario);
    ASSERT_TRUE(first.ok() && again.ok()) << command_of(scenario);
    EXPECT_EQ(first->events, again->events) << command_of(scenario);
    EXPECT_EQ(first->hash, again->hash) << command_of(scenario);
    EXPECT_EQ(first->coverage.recoveries, again->coverage.recoveries) << command_of(scenario);
  });
}

// A world that is divided by one policy again and again, on three servers, from the boxes of a grid on.
class Divisions : public Seeds, public ::testing::WithParamInterface<BalancePolicy> {};

TEST_P(Divisions, ChangeNoBit) {
  SimulatedCluster cluster(seed(), 3, Precision::kFloat32, {.balance_policy = BalancePolicy::kGrid});
  ASSERT_TRUE(cluster.load(corner_pile()).ok());
  bool has_moved = false;
  for (int n = 0; n < 6; ++n) {
    v1::BalanceRequest request;
    request.set_policy(std::string(name_of(n == 3 ? BalancePolicy::kGrid : GetParam())));
    const auto balance = cluster.call<v1::BalanceRequest, v1::BalanceReply>(std::move(request));
    ASSERT_TRUE(balance.ok()) << balance.status();
    has_moved |= balance->moves();
    ASSERT_TRUE(cluster.step(kTicks / 6).ok());
  }
  EXPECT_TRUE(has_moved || !follows_load(GetParam()));
  const auto hash = cluster.hash();
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(hash->hash, *Checker(corner_pile()).untouched_hash(kTicks)) << "seed " << seed();
}

// By itself, where what servers do takes time: the maps are others in every run.
TEST_P(Divisions, ChangeNoBitWhenTheyFollowWhatIsMeasured) {
  SimulatedCluster cluster(seed(), 3, Precision::kFloat32,
                           {.balance_every = milliseconds(100),
                            .balance_ahead = seconds(1),
                            .balance_policy = GetParam(),
                            .takes_time = true});
  ASSERT_TRUE(cluster.load(corner_pile()).ok());
  ASSERT_TRUE(cluster.step(kTicks).ok());
  const auto hash = cluster.hash();
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(hash->hash, *Checker(corner_pile()).untouched_hash(kTicks)) << "seed " << seed();
}

INSTANTIATE_TEST_SUITE_P(Policies, Divisions, ::testing::ValuesIn(kBalancePolicies),
                         [](const auto& instance) {
                           std::string name(name_of(instance.param));
                           std::erase(name, '-');
                           return name;
                         });

// A cluster of two servers whose world runs while one fault occurs.
class Faults : public Seeds {
 protected:
  void SetUp() override { ASSERT_TRUE(cluster_.load(corner_pile()).ok()); }

  // From the first ticks on.
  absl::Status step_through_cut(NodeId node, NodeId peer, std::chrono::nanoseconds length) {
    const std::uint64_t begin_ns = 20'000'000;
    cluster_.meet({{.kind = FaultKind::kCut,
                    .begin_ns = begin_ns,
                    .end_ns = begin_ns + static_cast<std::uint64_t>(length.count()),
                    .node = node,
                    .peer = peer}});
    const absl::Status stepped = cluster_.step(kTicks);
    stepped_ns_ = cluster_.network().now_ns();
    cluster_.outlast_faults();
    cluster_.run_events(100);  // messages that were held back arrive
    return stepped;
  }
  void expect_right_bits() {
    const auto hash = cluster_.hash();
    ASSERT_TRUE(hash.ok()) << hash.status();
    EXPECT_EQ(hash->hash, *Checker(corner_pile()).untouched_hash(kTicks)) << "seed " << seed();
  }
  // The one that was given up joins again.
  void expect_both_take_part() {
    const auto taking_part = [this] {
      const auto status = cluster_.status();
      return std::ranges::count_if(status->servers(),
                                   [](const v1::ServerStatus& server) { return server.takes_part(); });
    };
    for (int n = 0; n < 1000 && taking_part() < 2; ++n) cluster_.run_events(10);
    EXPECT_EQ(taking_part(), 2) << "seed " << seed();
  }

  static constexpr std::uint64_t kFoundNs = 2'500'000'000;  // by then, what is cut off is done without
  std::uint64_t stepped_ns_ = 0;
  SimulatedCluster cluster_{seed(), 2, Precision::kFloat32};
  NodeId first_ = cluster_.servers()[0];
  NodeId second_ = cluster_.servers()[1];
};

TEST_F(Faults, AServerThatIsCutOffForAMomentIsTakenBack) {
  EXPECT_TRUE(step_through_cut(kCoordinatorNode, second_, milliseconds(1500)).ok());
  EXPECT_EQ(cluster_.status()->recoveries(), 0u);
  expect_right_bits();
}

TEST_F(Faults, ServersWaitForEachOtherForAMoment) {
  EXPECT_TRUE(step_through_cut(first_, second_, milliseconds(900)).ok());
  EXPECT_EQ(cluster_.status()->recoveries(), 0u);
  expect_right_bits();
}

TEST_F(Faults, TheWorldGoesOnWithoutAServerThatAnotherOneDoesNotHear) {
  EXPECT_TRUE(step_through_cut(first_, second_, seconds(100)).ok());
  EXPECT_LT(stepped_ns_, kFoundNs);
  expect_right_bits();
  const auto status = cluster_.status();
  EXPECT_EQ(status->recoveries(), 1u);
  EXPECT_EQ(status->cut_off_servers(), 1u);
  ASSERT_EQ(status->cut_off_size(), 1);
  EXPECT_EQ(status->cut_off(0).node(), second_.value) << "of two, the one with the larger node";
  EXPECT_THAT(status->cut_off(0).unheard_by(), ::testing::ElementsAre(first_.value));
  EXPECT_GE(status->cut_off(0).seconds(), 1);
  expect_both_take_part();
}

// Whichever does not hear the other.
TEST_F(Faults, NorDoesACutOneWayStopIt) {
  for (const auto& [from, to] : {std::pair(first_, second_), std::pair(second_, first_)}) {
    cluster_.network().cut_one_way(from, to);
    const std::uint64_t begin_ns = cluster_.network().now_ns();
    EXPECT_TRUE(cluster_.step(kTicks / 2).ok());
    EXPECT_LT(cluster_.network().now_ns(), begin_ns + kFoundNs);
    cluster_.network().heal(from, to);
    expect_both_take_part();
  }
  EXPECT_EQ(cluster_.status()->cut_off_servers(), 2u);
}

TEST_F(Faults, AServerThatDoesNotHearTheCoordinatorIsDoneWithout) {
  cluster_.network().cut_one_way(kCoordinatorNode, second_);
  EXPECT_TRUE(cluster_.step(kTicks).ok());
  EXPECT_LT(cluster_.network().now_ns(), kFoundNs);
  expect_right_bits();
  cluster_.network().heal(kCoordinatorNode, second_);
  expect_both_take_part();
}

TEST_F(Faults, AServerThatComputesForLongIsWaitedFor) {
  constexpr std::uint64_t kLongNs = 6'000'000'000;
  cluster_.network().keep_busy(second_, cluster_.network().now_ns() + kLongNs);
  EXPECT_TRUE(cluster_.step(kTicks).ok());
  EXPECT_GT(cluster_.network().now_ns(), kLongNs);
  EXPECT_EQ(cluster_.status()->recoveries(), 0u);
  expect_right_bits();
}

TEST_F(Faults, AServerThatIsCutOffForLongerIsReplacedAndJoinsAnew) {
  EXPECT_TRUE(step_through_cut(kCoordinatorNode, second_, seconds(15)).ok());
  expect_right_bits();
  EXPECT_EQ(cluster_.end_of(first_), std::nullopt);
  EXPECT_EQ(cluster_.end_of(second_), std::nullopt);
  EXPECT_TRUE(cluster_.step(1).ok());
  EXPECT_EQ(cluster_.status()->recoveries(), 1u) << "without it; nobody goes back for one that joins";
  expect_both_take_part();
}

TEST_F(Faults, AKilledServerIsDoneWithout) {
  cluster_.network().kill(second_);
  const absl::Status stepped = cluster_.step(kTicks);
  EXPECT_TRUE(stepped.ok()) << stepped;
  EXPECT_EQ(cluster_.status()->recoveries(), 1u);
  expect_right_bits();
}

// What each server did of a world whose servers become more and fewer.
class ServerChanges : public Seeds {
 protected:
  ServerChanges() {
    options_.takes_all_servers = true;
    options_.reports = [this](NodeId server, const v1::Report& report) {
      for (const v1::TickReport& tick : report.ticks()) ticks_[server].push_back(tick.tick());
    };
  }

  SimulatedClusterOptions options_;
  std::map<NodeId, std::vector<Tick>> ticks_;
};

TEST_F(ServerChanges, FromTwoToFourToTwoNoTickIsRunTwice) {
  for_seeds(20, [&](std::uint64_t seed) {
    ticks_.clear();
    SimulatedCluster cluster(seed, 2, Precision::kFloat32, options_);
    while (cluster.status()->servers_size() < 2) cluster.run_events(1);
    ASSERT_TRUE(cluster.load(corner_pile()).ok());
    const std::vector<NodeId> first = cluster.servers();
    constexpr std::uint64_t kMs = 1'000'000;
    cluster.meet({{.kind = FaultKind::kJoin, .begin_ns = 20 * kMs},
                  {.kind = FaultKind::kJoin, .begin_ns = 30 * kMs},
                  {.kind = FaultKind::kDrain, .begin_ns = 150 * kMs, .node = first[0]},
                  {.kind = FaultKind::kDrain, .begin_ns = 160 * kMs, .node = first[1]}});
    constexpr Tick kLong = 300;
    ASSERT_TRUE(cluster.step(kLong).ok());
    cluster.outlast_faults();
    while (cluster.status()->servers_size() > 2) cluster.run_events(100);
    ASSERT_TRUE(cluster.step(1).ok());
    const auto hash = cluster.hash();
    ASSERT_TRUE(hash.ok()) << hash.status();
    EXPECT_EQ(hash->hash, *Checker(corner_pile()).untouched_hash(kLong + 1)) << "seed " << seed;
    const auto status = cluster.status();
    EXPECT_EQ(status->recoveries(), 0u) << "seed " << seed;
    EXPECT_EQ(status->joined_servers(), 2u) << "seed " << seed;
    EXPECT_EQ(status->left_servers(), 2u) << "seed " << seed;
    // Each server does some ticks without a gap, the two at first from the beginning, the others to the end.
    ASSERT_EQ(ticks_.size(), 4u) << "seed " << seed;
    for (auto& [server, ticks] : ticks_) {
      std::ranges::sort(ticks);  // reports overtake each other
      const bool is_first = server == first[0] || server == first[1];
      EXPECT_EQ(ticks.front() == 1, is_first) << "seed " << seed;
      EXPECT_EQ(ticks.back() == kLong + 1, !is_first) << "seed " << seed;
      EXPECT_EQ(ticks.back() - ticks.front() + 1, ticks.size()) << "seed " << seed;
      EXPECT_EQ(std::ranges::adjacent_find(ticks), ticks.end()) << "seed " << seed;
    }
  });
}

TEST_F(Faults, WithoutAnyServerTheWorldWaits) {
  const auto crash = FaultKind::kCrash;
  cluster_.meet({{.kind = crash, .begin_ns = 20'000'000, .end_ns = 30'000'000'000, .node = first_},
                 {.kind = crash, .begin_ns = 25'000'000, .end_ns = 60'000'000'000, .node = second_}});
  EXPECT_TRUE(cluster_.step(kTicks).ok());
  EXPECT_GT(cluster_.network().now_ns(), 30'000'000'000u);
  expect_right_bits();
}

}  // namespace
}  // namespace tessera
