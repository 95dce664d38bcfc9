// Granted ticks are carried out in order, whatever overtakes what on the way, and give the bits of one
// process.
#include <limits>

#include "proto/body_columns.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"
#include "proto/kept_chunks.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
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
    v1::Question& question = *grant.add_questions();
    question.set_id(serial);
    question.mutable_snapshot()->set_keeps(keeps);
    question.mutable_snapshot()->set_anew(anew);
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
  EXPECT_EQ(heard[0].question(), 11u);
  EXPECT_EQ(heard[0].tick(), 2u);
  EXPECT_EQ(heard[1].question(), 22u);
  EXPECT_EQ(heard[1].tick(), 7u);
  EXPECT_EQ(heard[2].question(), 33u);
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
    EXPECT_EQ(hash_in(answer), expected);
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

v1::Query ray_query(const Eigen::Vector3d& direction) {
  v1::Query query;
  *query.mutable_ray()->mutable_origin() = to_proto(WorldPosition{{0, 0, 3}, {0, 0, 0}});
  *query.mutable_ray()->mutable_direction() = to_proto(direction);
  query.mutable_ray()->set_length(20);
  query.mutable_ray()->set_mask(0xffffffff);
  return query;
}

v1::Query near_query() {
  v1::Query query;
  v1::NearQuery& near = *query.mutable_near();
  *near.mutable_pose() = to_proto(WorldPose{{{0, 0, 1}, {0, 0, 1.2}}});
  *near.mutable_probe() = to_proto(Shape{{{Sphere{0.1}, {}}}}).parts(0).geometry();
  near.set_reach(0.2);
  near.set_mask(0xffffffff);
  return query;
}

// All of a question are answered at once, in their order.
TEST_F(OneServer, AnswersWhatARayHitsAndWhatIsNear) {
  v1::Grant grant = grant_of(1, 0);
  v1::Question& question = *grant.add_questions();
  question.set_id(5);
  *question.mutable_queries()->add_all() = ray_query({0, 0, -1});
  *question.mutable_queries()->add_all() = ray_query({0, 1, 0});
  *question.mutable_queries()->add_all() = near_query();
  question.mutable_queries()->add_all()->mutable_hash();
  server_.grant(grant);
  server_.work();
  const std::vector<v1::Answer> heard = answers();
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].question(), 5u);
  ASSERT_EQ(heard[0].results_size(), 4);
  // The top of the uppermost box, body 7, is 5 m above the origin.
  const v1::RayHits& down = heard[0].results(0).result().ray();
  ASSERT_EQ(down.hits_size(), 1);
  EXPECT_EQ(down.hits(0).body(), 7u);
  EXPECT_NEAR(down.hits(0).distance(), 12 - 5, 0.05);
  EXPECT_NEAR(down.hits(0).normal().z(), 1, 1e-5);
  EXPECT_TRUE(heard[0].results(1).result().ray().hits().empty());
  const v1::NearBodies& near = heard[0].results(2).result().near();
  ASSERT_GE(near.bodies_size(), 1);
  EXPECT_EQ(near.bodies(0).id(), 7u);
  EXPECT_NE(WorldHash(heard[0].results(3).hash_low(), heard[0].results(3).hash_high()), WorldHash());
}

// Of all that are not static without ids, in the body frame; no id is the wrong one.
TEST_F(OneServer, AnswersWithTheStatesOfBodies) {
  v1::Grant grant = grant_of(1, 0);
  v1::Question& question = *grant.add_questions();
  question.mutable_queries()->add_all()->mutable_states();
  v1::StatesQuery& some = *question.mutable_queries()->add_all()->mutable_states();
  for (const std::uint64_t id : {0u, 1u, 7u, 99u}) some.add_ids(id);
  question.mutable_queries()->add_all()->mutable_states()->add_ids(0);
  server_.grant(grant);
  server_.work();
  const std::vector<v1::Answer> heard = answers();
  ASSERT_EQ(heard.size(), 1u);
  ASSERT_EQ(heard[0].results_size(), 3);
  const v1::BodyColumns& all = heard[0].results(0).result().states();
  EXPECT_THAT(std::vector<std::uint64_t>(all.ids().begin(), all.ids().end()),
              ::testing::UnorderedElementsAre(2, 3, 4, 5, 6, 7));
  EXPECT_EQ(all.positions_size(), 18);
  const v1::BodyColumns& two = heard[0].results(1).result().states();
  EXPECT_THAT(two.ids(), ElementsAre(1, 7));
  std::vector<BodyRow> rows;
  ASSERT_TRUE(append_rows(two, rows).ok());
  const WorldDescription world = small_tower();
  for (const auto& [row, body] : {std::pair(rows[0], world.bodies[0]), std::pair(rows[1], world.bodies[6])}) {
    const auto place =
        canonical(body.pose.position.sector, body.pose.position.local, world.settings.sector_size);
    EXPECT_EQ(row.pose.position.sector, place->sector);
    EXPECT_NEAR((row.pose.position.local - place->local).norm(), 0, 1e-6);
    EXPECT_FALSE(row.asleep);
  }
  EXPECT_TRUE(heard[0].results(2).result().states().ids().empty());
}

// Queries that no coordinator asks: their grant is not taken.
TEST_F(OneServer, LeavesForgedQueriesAlone) {
  v1::Query long_ray = ray_query({0, 0, 3});
  v1::Query endless = ray_query({0, 0, 1});
  endless.mutable_ray()->set_length(std::numeric_limits<double>::infinity());
  v1::Query far = near_query();
  far.mutable_near()->set_reach(1e9);
  v1::Query shapeless = near_query();
  shapeless.mutable_near()->clear_probe();
  v1::Query find;
  find.mutable_find_bodies();
  const std::pair<v1::Query, std::string> forged[] = {
      {long_ray, "no unit length"}, {endless, "length"},  {far, "reach"},
      {shapeless, "geometry"},      {find, "of no kind"}, {v1::Query(), "of no kind"},
  };
  for (const auto& [query, message] : forged) {
    server_.log.clear();
    v1::Grant grant = grant_of(1, 0);
    *grant.add_questions()->mutable_queries()->add_all() = query;
    server_.grant(grant);
    EXPECT_FALSE(server_.machine.work_left());
    EXPECT_THAT(server_.log, Contains(HasSubstr(message)));
  }
  server_.grant(grant_of(1, 1));
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 1u) << "and it goes on with the one that is due";
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
      {SetVelocity{ball.id, {std::numeric_limits<double>::infinity(), 0, 0}, {}},
       "body 100: a number of a command is not finite"},
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
