// Processes that are killed, stopped and replaced: the world goes on with the same bits, clients miss
// nothing.
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <random>
#include <vector>

#include "tests/cluster_fixture.h"
#include "tests/watched_run.h"

namespace tessera {
namespace {

using namespace tessera::testing;

class Recovery : public WatchedRun {
 protected:
  // The busy world on two servers, watched, running as fast as real time.
  void SetUp() override {
    cli::LocalClusterOptions options;
    options.checkpoint_every = absl::Milliseconds(200);
    options.store = true;
    cluster_ = start_cluster(2, options);
    ASSERT_TRUE(cluster_.client);
    begin(client());
  }

  Client& client() { return *cluster_.client; }
  cli::LocalCluster& processes() { return *cluster_.processes; }

  Cluster cluster_;
};

TEST_F(Recovery, FromServersThatAreKilledOneAfterTheOther) {
  for (const std::size_t place : {0, 1, 0}) {
    go_on(40);
    ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
    ASSERT_THAT(processes().replace_server(place), IsOk());
    go_on(40);
  }
  expect_as_undisturbed();
  EXPECT_GE(client().status().value().recoveries, 3u);
}

// Bodies have changed frames by then, and sleep; afterwards the train brakes. The ferry has met the quay.
TEST_F(Recovery, OfFramesThatMove) {
  constexpr std::uint64_t kTicks = 480;
  for (const char* name : {"train.sdf", "ferry.sdf"}) {
    const WorldDescription world = read_world(name);
    ASSERT_THAT(client().load(world, true).status(), IsOk());
    for (const std::size_t place : {0, 1}) {
      ASSERT_THAT(client().step(kTicks / 3, kPatience).status(), IsOk());
      ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
      ASSERT_THAT(processes().replace_server(place), IsOk());
    }
    ASSERT_THAT(client().step(kTicks / 3, kPatience).status(), IsOk());
    EXPECT_EQ(client().hash().value().hash, hash_in_process(world, kTicks)) << name;
  }
}

// A pod leaves the frame of a planet for the world, and comes into that of a station, where a ship docks that
// carries a frame itself: as one server after the other is killed.
TEST_F(Recovery, OfAVoyage) {
  constexpr std::uint64_t kTicks = 1500;
  const WorldDescription world = read_world("voyage.sdf");
  ASSERT_THAT(client().load(world, true).status(), IsOk());
  for (const std::size_t place : {0, 1, 0}) {
    ASSERT_THAT(client().step(kTicks / 4, kPatience).status(), IsOk());
    ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
    ASSERT_THAT(processes().replace_server(place), IsOk());
  }
  ASSERT_THAT(client().step(kTicks / 4, kPatience).status(), IsOk());
  EXPECT_EQ(client().hash().value().hash, hash_in_process(world, kTicks));
  const auto stream = client().watch_bodies({}, kPatience);
  ASSERT_THAT(stream.status(), IsOk());
  const absl::StatusOr<BodyFrame> frame = (*stream)->next(kPatience);
  ASSERT_THAT(frame.status(), IsOk());
  const auto body = [&](const std::string& name) {
    const BodyId id = client().find(name, kPatience).value().id;
    return std::ranges::find(frame->bodies, id, &BodySample::id)->pose.position;
  };
  const auto& frames = world.settings.frames;
  const auto station = std::ranges::find(frames, "station", &MovingFrame::name) - frames.begin() + 1;
  for (const char* part : {"pod::front", "pod::rear"}) EXPECT_EQ(body(part).sector.frame, station) << part;
  EXPECT_NEAR(body("ship::hull").local.z(), 11, 0.01) << "its side is at the port's";
}

TEST_F(Recovery, FromTheLossOfAllServersAtOnce) {
  go_on(60);
  for (const std::size_t place : {0, 1}) ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
  for (const std::size_t place : {0, 1}) ASSERT_THAT(processes().replace_server(place), IsOk());
  go_on(60);
  expect_as_undisturbed();
}

TEST_F(Recovery, IsWaitedForByAStreamThatBeginsMeanwhile) {
  go_on(20);
  for (const std::size_t place : {0, 1}) ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
  const absl::Time deadline = absl::Now() + kPatience;
  while (client().status().value().state != "recovering") ASSERT_LT(absl::Now(), deadline);
  auto stream = std::async(std::launch::async, [&] { return client().watch_bodies({}, kPatience); });
  for (const std::size_t place : {0, 1}) ASSERT_THAT(processes().replace_server(place), IsOk());
  const absl::StatusOr<std::unique_ptr<BodyStream>> begun = stream.get();
  ASSERT_THAT(begun.status(), IsOk());
  EXPECT_THAT((*begun)->next(kPatience).status(), IsOk());
}

TEST_F(Recovery, FromAServerThatStandsStillAndComesBack) {
  go_on(60);
  ASSERT_EQ(kill(processes().server(1), SIGSTOP), 0);
  go_on(60);
  ASSERT_EQ(kill(processes().server(1), SIGCONT), 0);
  ASSERT_TRUE(await_log(cluster_, "takes part in the world"));
  go_on(60);
  expect_as_undisturbed();
}

TEST_F(Recovery, FromTheLossOfTheCoordinator) {
  go_on(60);
  ASSERT_EQ(kill(processes().coordinator(), SIGKILL), 0);
  ASSERT_THAT(processes().replace_coordinator(), IsOk());
  go_on(60);
  expect_as_undisturbed();
}

TEST_F(Recovery, FromTheLossOfEverything) {
  go_on(60);
  read_until(told_ + 20);
  for (const std::size_t place : {0, 1}) ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
  ASSERT_EQ(kill(processes().coordinator(), SIGKILL), 0);
  ASSERT_THAT(processes().replace_coordinator(), IsOk());
  for (const std::size_t place : {0, 1}) ASSERT_THAT(processes().replace_server(place), IsOk());
  absl::StatusOr<Tick> tick = client().pause(kPatience);
  for (const absl::Time end = absl::Now() + kPatience;
       absl::IsUnavailable(tick.status()) && absl::Now() < end;) {
    tick = client().pause(kPatience);  // once there is a coordinator again
  }
  ASSERT_THAT(tick.status(), IsOk());
  EXPECT_GE(*tick, told_);
  const absl::StatusOr<HashAt> hash = client().hash(kPatience);
  ASSERT_THAT(hash.status(), IsOk());
  EXPECT_EQ(hash->hash, Undisturbed(world_, pushes_, *tick).hash);
}

// Of a variable of the environment.
int number_from(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  int number = otherwise;
  return text != nullptr && absl::SimpleAtoi(text, &number) ? number : otherwise;
}

// TESSERA_KILLS=100 TESSERA_STOPS=20 TESSERA_SEED=7 make a longer drill of it.
TEST_F(Recovery, FromLossesInAnyOrder) {
  enum class Fault { kServer, kCoordinator, kStop };
  const int seed = number_from("TESSERA_SEED", static_cast<int>(std::random_device()() >> 1));
  SCOPED_TRACE(absl::StrCat("TESSERA_SEED=", seed));
  std::mt19937 random(static_cast<std::uint32_t>(seed));
  std::vector<Fault> faults(static_cast<std::size_t>(number_from("TESSERA_STOPS", 1)), Fault::kStop);
  for (int kill = 0; kill < number_from("TESSERA_KILLS", 4); ++kill) {
    faults.push_back(random() % 3 == 0 ? Fault::kCoordinator : Fault::kServer);
  }
  std::shuffle(faults.begin(), faults.end(), random);
  std::vector<double> gaps_s;
  for (const Fault fault : faults) {
    go_on(20 + random() % 60);
    if (HasFatalFailure()) return;
    const std::size_t place = random() % 2;
    longest_gap_ = absl::ZeroDuration();
    if (fault == Fault::kServer) {
      ASSERT_EQ(kill(processes().server(place), SIGKILL), 0);
      ASSERT_THAT(processes().replace_server(place), IsOk());
    } else if (fault == Fault::kCoordinator) {
      ASSERT_EQ(kill(processes().coordinator(), SIGKILL), 0);
      ASSERT_THAT(processes().replace_coordinator(), IsOk());
    } else {
      ASSERT_EQ(kill(processes().server(place), SIGSTOP), 0);
      const absl::Time until = absl::Now() + absl::Seconds(5);
      while (absl::Now() < until && !HasFatalFailure()) go_on(10);
      ASSERT_EQ(kill(processes().server(place), SIGCONT), 0);
    }
    go_on(60);
    gaps_s.push_back(absl::ToDoubleSeconds(longest_gap_));
  }
  expect_as_undisturbed();
  std::sort(gaps_s.begin(), gaps_s.end());
  std::printf("%zu faults, %zu pushes; time without ticks: p50 %.2f s, max %.2f s\n", gaps_s.size(),
              pushes_.size(), gaps_s[gaps_s.size() / 2], gaps_s.back());
}

// Sectors change servers while the world runs, and nobody notices.
TEST_F(Recovery, IsNotNeededWhereTheWorldIsDividedAnew) {
  for (int n = 0; n < 8; ++n) {
    ASSERT_THAT(client().balance().status(), IsOk());
    go_on(20);
  }
  expect_as_undisturbed();
  EXPECT_EQ(client().status().value().recoveries, 0u);
}

// A rolling restart: no tick is lost or repeated to clients.
TEST_F(Recovery, IsNotNeededWhereServersAreDrainedBeforeTheyEnd) {
  go_on(30);
  for (const std::size_t place : {0, 1}) {
    ASSERT_THAT(processes().start_server(), IsOk());
    ASSERT_TRUE(await_joined(cluster_, 3));
    ASSERT_THAT(client().drain(client().status().value().servers[0].node).status(), IsOk());
    ASSERT_EQ(kill(processes().server(place), SIGTERM), 0);
    go_on(40);
  }
  expect_as_undisturbed();
}

}  // namespace
}  // namespace tessera
