// Granted ticks are carried out in order, whatever overtakes what on the way, and give the bits of one
// process.
#include <limits>

#include "proto/convert.h"
#include "proto/convert_counts.h"
#include "proto/kept_chunks.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Kind = v1::ClusterMessage::KindCase;

class OneServer : public testing::Test {
 protected:
  OneServer() {
    server_.start();
    server_.welcome();
    server_.load(loads_of(small_tower(), {kFirst})[0]);
  }

  std::vector<v1::Answer> answers() {
    std::vector<v1::Answer> result;
    for (const v1::ClusterMessage& message : server_.take(Kind::kAnswer)) result.push_back(message.answer());
    return result;
  }

  TestServer server_;
};

TEST_F(OneServer, DoesWhatIsGrantedAndNoMore) {
  EXPECT_FALSE(server_.machine.work_left());
  server_.grant(grant_of(1, 5));
  EXPECT_TRUE(server_.machine.work_left());
  EXPECT_EQ(server_.machine.tick(), 0u) << "receiving does no work";
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 5u);
  EXPECT_THAT(server_.observed, ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(server_.to_peers, IsEmpty());
  EXPECT_EQ(server_.machine.traffic().all_sent().bytes, 0u);
}

TEST_F(OneServer, GivesTheBitsOfASimulation) {
  server_.grant(grant_of(1, 60));
  server_.work();
  EXPECT_EQ(reported_hashes({&server_}), expected_hashes(small_tower(), 60));
}

TEST_F(OneServer, ReportsTicksInBundlesWithoutAGap) {
  server_.grant(grant_of(1, 20));
  server_.work();
  Tick last = 0;
  std::vector<int> sizes;
  for (const v1::ClusterMessage& message : server_.take(Kind::kReport)) {
    const v1::Report& report = message.report();
    EXPECT_EQ(report.world(), kWorld);
    EXPECT_EQ(report.bodies(), 6u);
    sizes.push_back(report.ticks_size());
    for (const v1::TickReport& tick : report.ticks()) EXPECT_EQ(tick.tick(), ++last);
    EXPECT_EQ(report.tick(), last);
  }
  EXPECT_THAT(sizes, ElementsAre(8, 8, 4));
  ASSERT_NE(server_.machine.last_tick(), nullptr);
  EXPECT_EQ(server_.machine.last_tick()->tick(), 20u);
  EXPECT_GT(counts_from(server_.machine.last_tick()->counts()).contacts, 0u);
}

// What has changed from time to time, put together, is all that there is; at rest that is nothing.
TEST_F(OneServer, TellsForCheckpointsWhatHasChanged) {
  KeptChunks kept;
  std::uint64_t serial = 0;
  const auto ask = [&](std::uint64_t ticks, bool keeps, bool anew) {
    v1::Grant grant = grant_of(++serial, ticks);
    v1::Query& query = *grant.add_queries();
    query.set_id(serial);
    query.mutable_snapshot()->set_keeps(keeps);
    query.mutable_snapshot()->set_anew(anew);
    server_.grant(grant);
    server_.work();
    std::vector<v1::SnapshotChunk> chunks;
    for (const v1::Answer& answer : answers())
      chunks.insert(chunks.end(), answer.snapshot().begin(), answer.snapshot().end());
    return chunks;
  };
  const auto all_sectors = [](const std::vector<v1::SnapshotChunk>& chunks) {
    std::vector<std::string> sectors;
    for (const v1::SnapshotChunk& chunk : chunks) {
      if (!chunk.has_sectors()) continue;
      const auto some = unpack_sectors(chunk.sectors());
      EXPECT_TRUE(some.ok()) << some.status();
      for (const MovedSector& sector : *some)
        sectors.push_back(pack(std::span<const MovedSector>(&sector, 1)));
    }
    return sectors;
  };
  std::size_t last = 0;
  for (int n = 0; n < 12; ++n) {
    const std::vector<v1::SnapshotChunk> changes = ask(n == 0 ? 0 : 60, /*keeps=*/true, /*anew=*/n == 0);
    for (const v1::SnapshotChunk& chunk : changes)
      tessera::apply(std::make_shared<const v1::SnapshotChunk>(chunk), kept);
    const std::vector<v1::SnapshotChunk> snapshot = ask(0, /*keeps=*/false, /*anew=*/false);
    EXPECT_EQ(all_sectors(snapshot_of(kept)), all_sectors(snapshot)) << "after tick " << 60 * n;
    EXPECT_EQ(shared_bytes(kept), snapshot.front().shared());
    last = changes.size();
  }
  EXPECT_EQ(last, 0u) << "all is at rest, and packed";
  EXPECT_EQ(ask(0, /*keeps=*/true, /*anew=*/true).size(), kept.size());
}

TEST_F(OneServer, StandsStillWhileNothingIsGranted) {
  server_.grant(grant_of(1, 3));
  server_.work();
  server_.take(Kind::kReport);
  for (int n = 0; n < 5; ++n) {
    server_.advance(std::chrono::seconds(1));
    EXPECT_FALSE(server_.machine.work_left());
    const auto reports = server_.take(Kind::kReport);
    ASSERT_EQ(reports.size(), 1u) << "but it shows that it lives";
    EXPECT_EQ(reports[0].report().tick(), 3u);
    EXPECT_EQ(reports[0].report().ticks_size(), 0);
  }
  EXPECT_NE(server_.machine.machine_between_ticks(), nullptr);
  server_.grant(grant_of(2, 1));
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 4u);
}

TEST_F(OneServer, CarriesGrantsOutInTheOrderOfTheirNumbers) {
  server_.grant(grant_of(3, 0, {33}));
  server_.grant(grant_of(2, 5, {22}));
  EXPECT_FALSE(server_.machine.work_left());
  server_.grant(grant_of(1, 2, {11}));
  server_.work();
  const std::vector<v1::Answer> heard = answers();
  ASSERT_EQ(heard.size(), 3u);
  EXPECT_EQ(heard[0].query(), 11u);
  EXPECT_EQ(heard[0].tick(), 2u);
  EXPECT_EQ(heard[1].query(), 22u);
  EXPECT_EQ(heard[1].tick(), 7u);
  EXPECT_EQ(heard[2].query(), 33u);
  EXPECT_EQ(heard[2].tick(), 7u);
}

TEST_F(OneServer, AnswersAfterTheLastTickOfTheGrant) {
  server_.grant(grant_of(1, 10, {5, 6}));
  server_.work();
  const std::vector<v1::Answer> heard = answers();
  ASSERT_EQ(heard.size(), 2u);
  const WorldHash expected = expected_hashes(small_tower(), 10).back();
  for (const v1::Answer& answer : heard) {
    EXPECT_EQ(answer.world(), kWorld);
    EXPECT_EQ(answer.tick(), 10u);
    EXPECT_EQ(WorldHash(answer.hash_low(), answer.hash_high()), expected);
  }
}

// Whoever floods a server with what is not its turn makes it remember some of it, and do nothing.
TEST_F(OneServer, RemembersSoManyGrantsAndRoundsAhead) {
  for (const std::uint64_t serial : {0ul, 65'537ul, ~0ul}) server_.grant(grant_of(serial, 10));
  EXPECT_THAT(server_.log, Contains(HasSubstr("grant 65537 is not one of the 65536 from 1 on")));
  v1::ClusterMessage message;
  v1::Round& round = *message.mutable_round();
  round.set_world(kWorld);
  for (Tick tick = 1; tick <= 70'000; ++tick) {
    round.set_tick(tick);
    server_.receive(kFirst, message);
  }
  EXPECT_THAT(server_.log, Contains(HasSubstr("messages of 65536 rounds already wait")));
  server_.grant(grant_of(1, 10));
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 10u);
}

TEST_F(OneServer, AnswersWhatARayHitsAndWhatIsNear) {
  v1::Grant grant = grant_of(1, 0);
  v1::Query& down = *grant.add_queries();
  down.set_id(1);
  *down.mutable_ray()->mutable_origin() = to_proto(WorldPosition{{0, 0, 3}, {0, 0, 0}});
  *down.mutable_ray()->mutable_direction() = to_proto(Eigen::Vector3d(0, 0, -1));
  down.mutable_ray()->set_length(20);
  down.mutable_ray()->set_mask(0xffffffff);
  v1::Query& aside = *grant.add_queries();
  aside = down;
  aside.set_id(2);
  *aside.mutable_ray()->mutable_direction() = to_proto(Eigen::Vector3d(0, 1, 0));
  v1::Query& around = *grant.add_queries();
  around.set_id(3);
  *around.mutable_near()->mutable_pose() = to_proto(WorldPose{{{0, 0, 1}, {0, 0, 1.2}}});
  *around.mutable_near()->mutable_probe() = to_proto(Shape{{{Sphere{0.1}, {}}}}).parts(0).geometry();
  around.mutable_near()->set_reach(0.2);
  around.mutable_near()->set_mask(0xffffffff);
  server_.grant(grant);
  server_.work();
  const std::vector<v1::Answer> heard = answers();
  ASSERT_EQ(heard.size(), 3u);
  // The top of the uppermost box, body 7, is 5 m above the origin.
  EXPECT_TRUE(heard[0].hit());
  EXPECT_EQ(heard[0].body(), 7u);
  EXPECT_NEAR(heard[0].distance(), 12 - 5, 0.05);
  EXPECT_FALSE(heard[1].hit());
  ASSERT_GE(heard[2].near_size(), 1);
  EXPECT_EQ(heard[2].near(0).body(), 7u);
}

TEST_F(OneServer, CommandsAndNewShapesActAtTheFirstTickOfTheirGrant) {
  BodyRecord ball;
  ball.id = BodyId{100};
  ball.properties.shape = small_tower().shapes.size();
  ball.state.position = {1.5, 0, 0};
  const std::vector<Command> commands = {SpawnBody{ball}, ApplyImpulse{BodyId{7}, {1, 0, 0}, {}}};
  v1::Grant grant = grant_of(1, 30, {9});
  *grant.add_new_shapes() = numbered(ball.properties.shape, Sphere{0.25});
  grant.set_commands(pack(std::span<const Command>(commands)));
  server_.grant(grant);
  server_.work();
  WorldDescription same = small_tower();
  same.shapes.push_back(Shape{{{Sphere{0.25}, {}}}});
  EXPECT_EQ(reported_hashes({&server_}), expected_hashes(same, 30, commands));
}

// Commands that no coordinator gives end the server with a message, and nothing else of it.
TEST(ForgedCommands, EndAServerWithAMessage) {
  BodyRecord ball;
  ball.id = BodyId{100};
  ball.state.position = {1.5, 0, 0};
  BodyRecord stranger = ball;
  stranger.properties.shape = 1000;
  BodyRecord known = ball;
  known.id = BodyId{2};
  known.properties.shape = 1;
  BodyState lost;
  lost.position[0] = std::numeric_limits<double>::quiet_NaN();
  const std::pair<Command, std::string> forged[] = {
      {SpawnBody{stranger}, "there is no shape 1000"},
      {SpawnBody{known}, "it is there already"},
      {SetVelocity{ball.id, {std::numeric_limits<double>::infinity(), 0, 0}, {}}, "linear velocity"},
      {Teleport{BodyId{2}, {}, lost}, "position"},
      {RemoveBody{BodyId{0}}, "the id must be"},
  };
  for (const auto& [command, message] : forged) {
    TestServer server;
    server.start();
    server.welcome();
    server.load(loads_of(small_tower(), {kFirst})[0]);
    v1::Grant grant = grant_of(1, 3);
    grant.set_commands(pack(std::span<const Command>(&command, 1)));
    server.grant(grant);
    server.work();
    ASSERT_TRUE(server.machine.finished());
    EXPECT_THAT(std::string(server.machine.finished()->message()), ::testing::HasSubstr(message));
  }
}

// A million spawns and removals leave nothing behind: see ShapeTable.
TEST_F(OneServer, ForgetsTheShapeOfTheLastBodyThatHadIt) {
  BodyRecord ball;
  ball.id = BodyId{100};
  ball.properties.shape = 70;
  ball.state.position = {1.5, 0, 0};
  v1::Grant spawn = grant_of(1, 3);
  *spawn.add_new_shapes() = numbered(70, Sphere{0.25});
  const std::vector<Command> spawned = {SpawnBody{ball}};
  spawn.set_commands(pack(std::span<const Command>(spawned)));
  server_.grant(spawn);
  v1::Grant removal = grant_of(2, 3);
  const std::vector<Command> removed = {RemoveBody{ball.id, 70}};
  removal.set_commands(pack(std::span<const Command>(removed)));
  server_.grant(removal);
  // That the id may be used again shows that it is forgotten; coordinators give each once.
  v1::Grant again = grant_of(3, 3);
  *again.add_new_shapes() = numbered(70, Sphere{0.125});
  server_.grant(again);
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 9u);
  EXPECT_THAT(server_.take(Kind::kGoodbye), IsEmpty());
}

}  // namespace
}  // namespace tessera
