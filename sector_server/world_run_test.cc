// Granted ticks are carried out in order, whatever overtakes what on the way, and give the bits of one
// process.
#include <limits>
#include <random>

#include "proto/convert.h"
#include "proto/convert_counts.h"
#include "proto/kept_chunks.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Kind = v1::ClusterMessage::KindCase;

v1::NumberedShape numbered(ShapeId id, Geometry geometry) {
  return to_proto(ShapeEntry{id, std::make_shared<const Shape>(Shape{{{std::move(geometry), {}}}})});
}

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

class TwoServers : public testing::Test {
 protected:
  TwoServers() {
    for (TestServer* server : {&first_, &second_}) {
      server->start();
      server->welcome();
    }
  }

  void load(const WorldDescription& world) {
    const std::vector<v1::LoadWorld> loads = loads_of(world, {kFirst, kSecond});
    first_.load(loads[0]);
    second_.load(loads[1]);
  }

  TestServer& server_of(NodeId node) { return node == kFirst ? first_ : second_; }

  void deliver(const Letter& letter) {
    TestServer& server = server_of(letter.to);
    server.receive(letter.from, letter.message);
    server.work();
  }

  // Moves what the servers have sent each other to what is under way.
  void post() {
    for (TestServer* server : {&first_, &second_}) {
      for (Letter& letter : std::exchange(server->to_peers, {})) under_way_.push_back(std::move(letter));
    }
  }

  void carry_all() {
    for (post(); !under_way_.empty(); post()) {
      for (const Letter& letter : std::exchange(under_way_, {})) deliver(letter);
    }
  }

  // Whatever is under way arrives in an order that `seed` draws.
  void carry_all_shuffled(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    for (post(); !under_way_.empty(); post()) {
      std::swap(under_way_[random() % under_way_.size()], under_way_.back());
      const Letter letter = std::move(under_way_.back());
      under_way_.pop_back();
      deliver(letter);
    }
  }

  TestServer first_{kFirst};
  TestServer second_{kSecond};
  std::vector<Letter> under_way_;
};

TEST_F(TwoServers, EachWaitsInATickForTheOther) {
  load(small_tower());
  first_.grant(grant_of(1, 2));
  first_.work();
  EXPECT_EQ(first_.machine.tick(), 0u);
  EXPECT_FALSE(first_.machine.work_left());
  EXPECT_EQ(first_.machine.machine_between_ticks(), nullptr) << "a tick is under way";
  ASSERT_EQ(first_.to_peers.size(), 1u);
  const v1::Round& round = first_.to_peers[0].message.round();
  EXPECT_EQ(first_.to_peers[0].to, kSecond);
  EXPECT_EQ(round.world(), kWorld);
  EXPECT_EQ(round.tick(), 1u);
  EXPECT_EQ(first_.machine.traffic().all_sent().bytes, round.body().size());

  carry_all();
  EXPECT_EQ(first_.machine.tick(), 0u) << "the other one has no grant yet";
  second_.grant(grant_of(1, 2));
  second_.work();
  carry_all();
  EXPECT_EQ(first_.machine.tick(), 2u);
  EXPECT_EQ(second_.machine.tick(), 2u);
}

TEST_F(TwoServers, GiveTheBitsOfASimulation) {
  load(small_tower());
  for (TestServer* server : {&first_, &second_}) server->grant(grant_of(1, 60));
  first_.work();
  second_.work();
  carry_all();
  EXPECT_EQ(reported_hashes({&first_, &second_}), expected_hashes(small_tower(), 60));
  EXPECT_FALSE(first_.has_ended());
  EXPECT_FALSE(second_.has_ended());
}

TEST_F(TwoServers, GiveTheSameBitsWhateverOvertakesWhat) {
  const std::vector<WorldHash> expected = expected_hashes(small_tower(), 24);
  for (std::uint64_t number = 1; number <= 8; ++number) {
    const std::vector<v1::LoadWorld> loads = loads_of(small_tower(), {kFirst, kSecond}, number);
    for (const NodeId node : {kFirst, kSecond}) {
      v1::ClusterMessage load;
      *load.mutable_load_world() = loads[node == kFirst ? 0 : 1];
      under_way_.push_back({kCoordinatorNode, node, load});
      for (std::uint64_t serial = 1; serial <= 4; ++serial) {
        under_way_.push_back({kCoordinatorNode, node, message_of(grant_of(serial, 6, {}, number))});
      }
    }
    carry_all_shuffled(number);
    EXPECT_EQ(first_.machine.tick(), 24u);
    EXPECT_EQ(second_.machine.tick(), 24u);
    EXPECT_EQ(reported_hashes({&first_, &second_}), expected) << "world " << number;
  }
}

TEST_F(TwoServers, MoveSectorsAtTheFirstTickOfTheGrantThatHasTheMap) {
  load(small_tower());
  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  std::uint64_t serial = 1;
  // All to the first server, all to the second.
  for (const std::int64_t splitter : {kFar, -kFar}) {
    v1::Grant grant = grant_of(serial++, 20);
    for (auto set : {&v1::SectorIndex::set_i, &v1::SectorIndex::set_j, &v1::SectorIndex::set_k}) {
      if (grant.map().splitters_size() == 0) grant.mutable_map()->add_splitters();
      (grant.mutable_map()->mutable_splitters(0)->*set)(splitter);
    }
    grant.mutable_map()->set_epoch(serial);
    for (TestServer* server : {&first_, &second_}) {
      server->grant(grant);
      server->work();
    }
    carry_all();
    EXPECT_EQ(first_.machine.machine_between_ticks()->partition().bodies.empty(), splitter < 0);
    EXPECT_EQ(second_.machine.machine_between_ticks()->partition().bodies.empty(), splitter > 0);
  }
  EXPECT_EQ(reported_hashes({&first_, &second_}), expected_hashes(small_tower(), 40));
}

TEST_F(TwoServers, EndWhereAMapCannotBe) {
  load(small_tower());
  v1::Grant grant = grant_of(1, 1);
  grant.mutable_map()->set_epoch(2);  // one run for two servers
  first_.grant(grant);
  first_.work();
  EXPECT_TRUE(first_.has_ended());
  grant.mutable_map()->add_owners(2);  // there are 0 and 1
  second_.grant(grant);
  second_.work();
  EXPECT_TRUE(second_.has_ended());
}

TEST_F(TwoServers, MoveSectorsByMapsWhoseRunsHaveOwners) {
  load(small_tower());
  std::uint64_t serial = 1;
  // One run, of each server.
  for (const Rank owner : {1, 0}) {
    v1::Grant grant = grant_of(serial++, 20);
    grant.mutable_map()->add_owners(owner);
    grant.mutable_map()->set_epoch(serial);
    for (TestServer* server : {&first_, &second_}) {
      server->grant(grant);
      server->work();
    }
    carry_all();
    EXPECT_EQ(first_.machine.machine_between_ticks()->partition().bodies.empty(), owner == 1);
    EXPECT_EQ(second_.machine.machine_between_ticks()->partition().bodies.empty(), owner == 0);
  }
  EXPECT_EQ(reported_hashes({&first_, &second_}), expected_hashes(small_tower(), 40));
}

v1::Grant map_grant(std::uint64_t serial, std::uint64_t epoch, std::initializer_list<NodeId> nodes,
                    Rank owner) {
  v1::Grant grant = grant_of(serial, 0);
  grant.mutable_map()->set_epoch(epoch);
  grant.mutable_map()->add_owners(owner);
  for (const NodeId node : nodes) grant.mutable_map()->add_nodes(node.value);
  return grant;
}

// The second joins the world of the first, takes over all that it has, and the first leaves.
TEST_F(TwoServers, JoinAndLeaveBetweenTicks) {
  first_.load(loads_of(small_tower(), {kFirst})[0]);
  first_.grant(grant_of(1, 10));
  first_.work();
  const auto records = records_of(small_tower());
  const auto joints = joint_records_of(small_tower());
  const std::vector<NodeId> nodes{kFirst};
  v1::LoadWorld guest = guest_load(kWorld, {WorldToLoad::Described{small_tower(), *records, *joints}}, nodes,
                                   SectorMap({}, {}, 1));
  *guest.mutable_guest()->add_past() = grant_of(0, 10);
  guest.mutable_guest()->set_serial(2);
  guest.set_hash_ticks(true);
  second_.load(guest);
  EXPECT_THAT(second_.take(v1::ClusterMessage::kLoaded), IsEmpty()) << "links are not there yet";
  carry_all();
  EXPECT_EQ(second_.take(v1::ClusterMessage::kLoaded).size(), 1u);
  EXPECT_EQ(second_.machine.tick(), 10u);
  EXPECT_EQ(second_.machine.machine_between_ticks(), nullptr) << "a guest has nothing to show";

  v1::Grant joins = map_grant(3, 2, {kFirst, kSecond}, 1);
  joins.mutable_map()->set_newcomers(1);
  for (TestServer* server : {&first_, &second_}) {
    server->grant(grant_of(2, 5));
    server->grant(joins);
    server->grant(grant_of(4, 5));
    server->work();
  }
  carry_all();
  EXPECT_TRUE(first_.machine.machine_between_ticks()->partition().bodies.empty());
  EXPECT_EQ(second_.machine.tick(), 20u);

  for (TestServer* server : {&first_, &second_}) {
    server->grant(map_grant(5, 3, {kSecond}, 0));
    server->work();
  }
  EXPECT_EQ(first_.machine.machine_between_ticks(), nullptr);
  EXPECT_FALSE(first_.has_ended());
  second_.grant(grant_of(6, 10));
  second_.work();
  EXPECT_EQ(second_.machine.tick(), 30u);
  EXPECT_EQ(reported_hashes({&first_, &second_}), expected_hashes(small_tower(), 30));
}

TEST_F(TwoServers, EndWhereAServerThatHasSectorsIsToLeave) {
  load(small_tower());
  first_.grant(map_grant(1, 2, {kSecond}, 0));
  first_.work();
  EXPECT_TRUE(first_.has_ended());
}

TEST_F(TwoServers, SayWhatTheyHaveToDo) {
  load(small_tower());
  v1::Grant grant = grant_of(1, 10);
  grant.add_queries()->mutable_load();
  for (TestServer* server : {&first_, &second_}) {
    server->grant(grant);
    server->work();
  }
  carry_all();
  std::uint64_t bodies = 0;
  double work = 0;
  for (TestServer* server : {&first_, &second_}) {
    const auto answers = server->take(Kind::kAnswer);
    ASSERT_EQ(answers.size(), 1u);
    for (const v1::LoadPiece& piece : answers[0].answer().load().pieces()) {
      work += piece.work();
      bodies += piece.bodies();
    }
  }
  EXPECT_EQ(bodies, 6u);
  EXPECT_GE(work, 6) << "all are awake";
}

TEST_F(TwoServers, AnswerForTheirOwnBodiesAlone) {
  load(small_tower());
  for (TestServer* server : {&first_, &second_}) {
    server->grant(grant_of(1, 10, {1}));
    server->work();
  }
  carry_all();
  WorldHash sum;
  for (TestServer* server : {&first_, &second_}) {
    const auto answers = server->take(Kind::kAnswer);
    ASSERT_EQ(answers.size(), 1u);
    sum.add(WorldHash(answers[0].answer().hash_low(), answers[0].answer().hash_high()));
  }
  EXPECT_EQ(sum, expected_hashes(small_tower(), 10).back());
}

TEST_F(TwoServers, NeedNoMessagesInAWorldAtRest) {
  WorldBuilder builder(WorldSettings{});
  builder.add_floor(10, 0);
  load(builder.world());
  for (TestServer* server : {&first_, &second_}) {
    server->grant(grant_of(1, 1));
    server->work();
  }
  carry_all();
  ASSERT_EQ(first_.machine.tick(), 1u);

  first_.grant(grant_of(2, 50));
  first_.work();
  EXPECT_EQ(first_.machine.tick(), 51u) << "on its own";
  EXPECT_THAT(first_.to_peers, IsEmpty());

  // A ball falls onto the floor: from there on, they need each other again.
  BodyRecord ball;
  ball.id = BodyId{2};
  ball.properties.shape = 1;
  ball.state.position = {0, 0, 2};
  const std::vector<Command> commands = {SpawnBody{ball}};
  v1::Grant spawn = grant_of(3, 20);
  *spawn.add_new_shapes() = numbered(ball.properties.shape, Sphere{0.5});
  spawn.set_commands(pack(std::span<const Command>(commands)));
  first_.grant(spawn);
  first_.work();
  carry_all();
  EXPECT_EQ(first_.machine.tick(), 51u);
  EXPECT_EQ(second_.machine.tick(), 1u) << "it has been told of tick 52, and waits for its own grants";
  second_.grant(grant_of(2, 50));
  second_.grant(spawn);
  second_.work();
  carry_all();
  EXPECT_EQ(first_.machine.tick(), 71u);
  EXPECT_EQ(second_.machine.tick(), 71u);
  TickCounts counts = counts_from(first_.machine.last_tick()->counts());
  counts += counts_from(second_.machine.last_tick()->counts());
  EXPECT_GT(counts.bodies_awake, 0u);
}

TEST_F(TwoServers, AnUnloadInTheMiddleOfATickEndsItForBoth) {
  load(small_tower());
  for (TestServer* server : {&first_, &second_}) {
    server->grant(grant_of(1, 5));
    server->work();
  }
  first_.unload();
  carry_all();
  EXPECT_FALSE(first_.has_ended());
  EXPECT_EQ(second_.machine.tick(), 0u) << "it waits for what never comes";
  second_.unload();
  EXPECT_FALSE(second_.machine.work_left());
  const std::vector<v1::LoadWorld> loads = loads_of(small_tower(), {kFirst, kSecond}, kWorld + 1);
  first_.load(loads[0]);
  second_.load(loads[1]);
  for (TestServer* server : {&first_, &second_}) {
    server->grant(grant_of(1, 5, {}, kWorld + 1));
    server->work();
  }
  carry_all();
  EXPECT_EQ(second_.machine.tick(), 5u);
}

}  // namespace
}  // namespace tessera
