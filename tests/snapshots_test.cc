// A world that is restored from a snapshot, on any number of servers, goes on with the bits that it would
// have had.
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

class SnapshotsTest : public ::testing::Test {
 protected:
  SnapshotsTest() : folder_(cli::make_temporary_folder().value()) {}
  ~SnapshotsTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

  nlohmann::json run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "run");
    for (const std::string& more : {std::string("--json"), file("report.json").string()}) {
      arguments.push_back(more);
    }
    const Outcome outcome = run_tessera(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    std::ifstream in(file("report.json"));
    return nlohmann::json::parse(in, nullptr, false);
  }

 private:
  std::filesystem::path folder_;
};

std::string hash_of(Client& client) {
  const absl::StatusOr<HashAt> hash = client.hash();
  EXPECT_THAT(hash.status(), IsOk());
  return hash.ok() ? hash->hash : "";
}

// Commands that are accepted while a world is paused take effect at its next ticks; one after a teleport at
// the tick after that.
void hold_commands(Client& client) {
  ASSERT_THAT(client.spawn(solid("guest", box(0.4, 0.5, 0.6), 3, {{0, 0, 0}, {1, 1, 9}})).status(), IsOk());
  ASSERT_THAT(client.teleport("guest", {{{0, 0, 0}, {2, 2, 12}}, Eigen::Quaterniond::Identity()}).status(),
              IsOk());
  ASSERT_THAT(client.spawn(solid("second", sphere(0.37), 3, {{0, 0, 0}, {-1, 1, 9}})).status(), IsOk());
  ASSERT_THAT(client.apply_impulse("guest", {1, 2, 3}).status(), IsOk());
}

TEST_F(SnapshotsTest, AWorldWithCommandsToComeGoesOnOnAnyNumberOfServers) {
  std::string expected;
  {
    const Cluster cluster = start_cluster(2);
    ASSERT_TRUE(cluster.client);
    Client& client = *cluster.client;
    ASSERT_THAT(client.load(read_world("busy.sdf")).status(), IsOk());
    ASSERT_THAT(client.step(60, kPatience).status(), IsOk());
    ASSERT_NO_FATAL_FAILURE(hold_commands(client));
    const absl::StatusOr<SnapshotSummary> taken = client.snapshot(file("a"));
    ASSERT_THAT(taken.status(), IsOk());
    EXPECT_EQ(taken->tick, 60u);
    ASSERT_THAT(client.step(40, kPatience).status(), IsOk());
    ASSERT_THAT(client.snapshot(file("b")).status(), IsOk());
    expected = hash_of(client);
  }
  for (const int servers : {1, 3}) {
    const Cluster cluster = start_cluster(servers);
    ASSERT_TRUE(cluster.client);
    Client& client = *cluster.client;
    ASSERT_THAT(client.restore(file("a")).status(), IsOk());
    EXPECT_EQ(client.status()->tick, 60u);
    EXPECT_EQ(client.status()->state, "paused");
    EXPECT_EQ(client.find_bodies("guest")->bodies.size(), 1u);
    ASSERT_THAT(client.step(40, kPatience).status(), IsOk());
    EXPECT_EQ(hash_of(client), expected) << servers << " servers";
    const std::vector<std::string> compare = {"snapshot", file("b").string(), "--compare", "--connect",
                                              cluster.processes->address()};
    const Outcome equal = run_tessera(compare);
    EXPECT_EQ(equal.code, 0) << equal.output;
    ASSERT_THAT(client.apply_impulse("second", {0, 0, 9}).status(), IsOk());
    ASSERT_THAT(client.step(1, kPatience).status(), IsOk());
    const Outcome later = run_tessera(compare);
    EXPECT_EQ(later.code, 1);
    EXPECT_THAT(later.output, HasSubstr("one is of tick 100, the other of tick 101"));
    // A second branch.
    ASSERT_THAT(client.restore(file("b"), /*replace=*/true).status(), IsOk());
    EXPECT_EQ(hash_of(client), expected);
  }
}

TEST_F(SnapshotsTest, AWorldThatRunsIsTakenBetweenTwoTicks) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("seam.sdf")).status(), IsOk());
  ASSERT_THAT(client.resume(/*real_time_factor=*/0).status(), IsOk());
  const absl::StatusOr<SnapshotSummary> taken = client.snapshot(file("a"));
  ASSERT_THAT(taken.status(), IsOk());
  ASSERT_THAT(client.unload(), IsOk());
  ASSERT_THAT(client.restore(file("a")).status(), IsOk());
  EXPECT_EQ(client.status()->tick, taken->tick);
  EXPECT_EQ(hash_of(client), hash_in_process(read_world("seam.sdf"), taken->tick));
}

TEST_F(SnapshotsTest, ARunGoesOnFromTheEndOfAnother) {
  const std::string world = world_file("busy.sdf").string();
  const std::string expected = run({world, "--in-process", "--seconds", "2"})["world_hash"];
  run({world, "--servers", "2", "--seconds", "1", "--snapshot", file("a").string()});
  const nlohmann::json alone = run({"--from", file("a").string(), "--in-process", "--seconds", "1"});
  EXPECT_EQ(alone["world_hash"], expected);
  EXPECT_EQ(alone["first_tick"], 60);
  EXPECT_EQ(run({"--from", file("a").string(), "--servers", "3", "--seconds", "1"})["world_hash"], expected);
  EXPECT_THAT(run_tessera({"run", "--from", file("a").string(), "--sector-size", "8"}).output,
              HasSubstr("a snapshot has its settings"));
}

TEST_F(SnapshotsTest, WhatIsRefusedChangesNothing) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(read_world("seam.sdf")).status(), IsOk());
  ASSERT_THAT(client.step(30, kPatience).status(), IsOk());
  const std::string before = hash_of(client);
  ASSERT_THAT(client.snapshot(file("a")).status(), IsOk());
  EXPECT_THAT(client.restore(file("a")).status(), IsStatus(absl::StatusCode::kAlreadyExists, "is loaded"));
  std::ifstream in(file("a"), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::ofstream(file("short"), std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(file("damaged"), std::ios::binary) << bytes;
  EXPECT_THAT(client.restore(file("damaged"), true).status(),
              IsStatus(absl::StatusCode::kDataLoss, "is damaged"));
  EXPECT_THAT(client.restore(file("short"), true).status(),
              IsStatus(absl::StatusCode::kDataLoss, "is cut off"));
  EXPECT_THAT(client.restore(file("none"), true).status(),
              IsStatus(absl::StatusCode::kNotFound, "cannot read"));
  EXPECT_THAT(client.restore(world_file("seam.sdf"), true).status(),
              IsStatus(absl::StatusCode::kDataLoss, "no snapshot"));
  EXPECT_EQ(hash_of(client), before);
}

}  // namespace
}  // namespace tessera
