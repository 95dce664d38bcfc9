#include "embedded/embedded_cluster.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"
#include "proto/convert.h"
#include "tessera/client.h"

namespace tessera {
namespace {

constexpr std::uint64_t kTicks = 60;

// Towers on both sides of borders of sectors.
WorldDescription four_towers() {
  WorldSettings settings;
  settings.sector_size = 8;
  WorldBuilder builder(settings);
  builder.add_floor(40, 0);
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  for (int tower = 0; tower < 4; ++tower) {
    for (int n = 0; n < 5; ++n) {
      const std::string name = "box" + std::to_string(5 * tower + n);
      builder.add(name, box, 100, {tower * 8 - 12.0 + 0.1 * n, 0.05 * n, n + 0.5});
    }
  }
  return builder.world();
}

v1::LoadRequest load_of(const WorldDescription& world, bool replace = false) {
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  request.set_replace(replace);
  return request;
}

absl::StatusOr<v1::LoadReply> load(EmbeddedCluster& cluster, const WorldDescription& world) {
  return cluster.call<v1::LoadRequest, v1::LoadReply>(load_of(world));
}

absl::StatusOr<v1::Reply> ask(EmbeddedCluster& cluster, v1::Request request) {
  return cluster.call<v1::Request, v1::Reply>(std::move(request));
}

absl::StatusOr<std::string> hash_after(EmbeddedCluster& cluster, std::uint64_t ticks) {
  v1::Request request;
  request.set_ticks(ticks);
  request.add_queries()->mutable_hash();
  const absl::StatusOr<v1::Reply> reply = ask(cluster, request);
  if (!reply.ok()) return reply.status();
  return reply->results(0).hash().hash();
}

std::string hash_of_simulation(const WorldDescription& world) {
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
  EXPECT_TRUE(simulation.ok()) << simulation.status();
  for (std::uint64_t n = 0; n < kTicks; ++n) (*simulation)->step();
  return (*simulation)->hash().to_string();
}

TEST(EmbeddedCluster, HasTheBitsOfASimulationWhateverItsServers) {
  const WorldDescription world = four_towers();
  const std::string expected = hash_of_simulation(world);
  for (const std::uint32_t servers : {1U, 2U, 4U}) {
    EmbeddedCluster cluster({.servers = servers});
    ASSERT_TRUE(load(cluster, world).ok());
    const absl::StatusOr<std::string> hash = hash_after(cluster, kTicks);
    ASSERT_TRUE(hash.ok()) << hash.status();
    EXPECT_EQ(*hash, expected) << servers << " servers";
  }
}

TEST(EmbeddedCluster, AnswersWithErrorsOfTheCoordinator) {
  EmbeddedCluster cluster({});
  EXPECT_TRUE(absl::IsFailedPrecondition(hash_after(cluster, 1).status()));
  WorldDescription world = four_towers();
  ASSERT_TRUE(load(cluster, world).ok());
  EXPECT_TRUE(absl::IsAlreadyExists(load(cluster, world).status()));
  world.bodies[1].properties.mass = -1;
  const absl::Status status = cluster.call<v1::LoadRequest, v1::LoadReply>(load_of(world, true)).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  EXPECT_TRUE(hash_after(cluster, 1).ok());  // the world before is still there
}

TEST(EmbeddedCluster, ReplacesWorlds) {
  EmbeddedCluster cluster({.servers = 2});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  ASSERT_TRUE(hash_after(cluster, 3).ok());
  ASSERT_TRUE((cluster.call<v1::LoadRequest, v1::LoadReply>(load_of(four_towers(), true)).ok()));
  const absl::StatusOr<std::string> hash = hash_after(cluster, kTicks);
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(*hash, hash_of_simulation(four_towers()));
}

TEST(EmbeddedCluster, GoesOnFromASnapshotWithTheSameBits) {
  EmbeddedCluster cluster({.servers = 2});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  ASSERT_TRUE(hash_after(cluster, kTicks / 2).ok());
  absl::StatusOr<SnapshotChunks> snapshot = cluster.call<v1::SnapshotRequest, SnapshotChunks>({});
  ASSERT_TRUE(snapshot.ok()) << snapshot.status();
  EmbeddedCluster other({.servers = 1});
  ASSERT_TRUE((other.call<RestoreChunks, v1::LoadReply>({false, false, *std::move(snapshot)}).ok()));
  const absl::StatusOr<std::string> hash = hash_after(other, kTicks / 2);
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(*hash, hash_of_simulation(four_towers()));
}

TEST(EmbeddedCluster, AWorldRunsByItselfUntilItIsPaused) {
  EmbeddedCluster cluster({});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  v1::ResumeRequest resume;
  resume.set_real_time_factor(0);  // as fast as it can
  ASSERT_TRUE((cluster.call<v1::ResumeRequest, v1::ResumeReply>(resume).ok()));
  v1::Request now;
  now.add_queries()->mutable_hash();
  absl::StatusOr<v1::Reply> reply;
  do {
    reply = ask(cluster, now);
    ASSERT_TRUE(reply.ok()) << reply.status();
  } while (reply->tick() < 50);
  const absl::StatusOr<v1::PauseReply> paused = cluster.call<v1::PauseRequest, v1::PauseReply>({});
  ASSERT_TRUE(paused.ok()) << paused.status();
  const absl::StatusOr<v1::Reply> after = ask(cluster, now);
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_EQ(after->tick(), paused->tick());
}

TEST(EmbeddedCluster, ManyThreadsMayAsk) {
  EmbeddedCluster cluster({});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  std::atomic<int> failures = 0;
  std::atomic<bool> is_over = false;
  std::vector<std::thread> threads;
  for (int n = 0; n < 3; ++n) {
    threads.emplace_back([&] {
      while (!is_over) failures += hash_after(cluster, 0).ok() ? 0 : 1;
    });
  }
  for (std::uint64_t n = 0; n < kTicks; ++n) failures += hash_after(cluster, 1).ok() ? 0 : 1;
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, 0);
  const absl::StatusOr<std::string> hash = hash_after(cluster, 0);
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(*hash, hash_of_simulation(four_towers()));
}

TEST(EmbeddedCluster, ServesClientsWhileItsOwnCallsGoOn) {
  EmbeddedCluster cluster({.servers = 2});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  const absl::StatusOr<std::string> address = cluster.serve("127.0.0.1:0");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(cluster.serve("127.0.0.1:0").value(), *address);
  const auto client = Client::connect(*address).value();
  const auto bodies = client->watch_bodies().value();
  std::atomic<bool> is_over = false;
  std::thread observer([&] {
    while (!is_over) EXPECT_TRUE(client->status().ok());
  });
  for (std::uint64_t n = 0; n < kTicks; ++n) EXPECT_TRUE(hash_after(cluster, 1).ok());
  is_over = true;
  observer.join();
  Tick last = 0;
  while (last < kTicks) {
    const auto frame = bodies->next();
    ASSERT_TRUE(frame.ok()) << frame.status();
    last = frame->tick;
  }
  EXPECT_EQ(client->hash()->hash, hash_of_simulation(four_towers()));
  EXPECT_EQ(client->step(1).value(), kTicks + 1);
}

TEST(EmbeddedCluster, ServesThisMachineAlone) {
  EmbeddedCluster cluster({});
  const absl::Status status = cluster.serve("0.0.0.0:0").status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_TRUE(absl::IsInvalidArgument(cluster.serve("nowhere").status()));
}

TEST(EmbeddedCluster, ACallEndsWhenItIsInterrupted) {
  EmbeddedCluster cluster({});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  v1::Request request;
  request.set_ticks(1'000'000);
  const absl::Status status = cluster.call<v1::Request, v1::Reply>(request, {}, [] { return true; }).status();
  EXPECT_TRUE(absl::IsCancelled(status)) << status;
  ASSERT_TRUE((cluster.call<v1::PauseRequest, v1::PauseReply>({}).ok()));
  EXPECT_TRUE(hash_after(cluster, 1).ok());
}

TEST(EmbeddedCluster, ACallEndsWhenItsTimeIsOver) {
  EmbeddedCluster cluster({});
  ASSERT_TRUE(load(cluster, four_towers()).ok());
  v1::Request request;
  request.set_ticks(1'000'000);
  const absl::Status status =
      cluster.call<v1::Request, v1::Reply>(request, std::chrono::milliseconds(1)).status();
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
}

}  // namespace
}  // namespace tessera
