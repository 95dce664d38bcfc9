// Servers that wait for each other in a tick: whatever overtakes what between them, they give the bits of one
// process.
#include <random>

#include "proto/convert_counts.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using ::testing::IsEmpty;
using Kind = v1::ClusterMessage::KindCase;

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

// The other one has not been granted the tick, and says that it is there.
TEST_F(TwoServers, OneThatWaitsForLongAsksTheOther) {
  load(small_tower());
  first_.grant(grant_of(1, 2));
  first_.work();
  post();
  under_way_.clear();  // the round: what follows are questions
  first_.take(Kind::kReport);
  for (int n = 0; n < 2; ++n) first_.advance(PeerProbes::kEvery);
  post();
  ASSERT_EQ(under_way_.size(), 1u);
  EXPECT_TRUE(under_way_[0].message.has_greeting());
  carry_all();
  for (int n = 0; n < 4; ++n) {
    first_.advance(PeerProbes::kEvery);
    carry_all();
  }
  for (const v1::ClusterMessage& message : first_.take(Kind::kReport))
    EXPECT_THAT(message.report().unheard(), IsEmpty());
}

TEST_F(TwoServers, OneThatIsNotAnsweredSaysSo) {
  load(small_tower());
  first_.grant(grant_of(1, 2));
  first_.work();
  for (int n = 0; n < 6; ++n) {
    EXPECT_LE(first_.machine.next_deadline(), first_.now + PeerProbes::kEvery);
    first_.advance(PeerProbes::kEvery);
  }
  const auto reports = first_.take(Kind::kReport);
  ASSERT_FALSE(reports.empty());
  const v1::Report& last = reports.back().report();
  ASSERT_EQ(last.unheard_size(), 1);
  EXPECT_EQ(last.unheard(0).node(), kSecond.value);
  EXPECT_EQ(last.unheard(0).waited_ms(), 1000u);
  EXPECT_TRUE(last.unheard(0).silent()) << "nothing has ever come from it";
  second_.grant(grant_of(1, 2));
  second_.work();
  carry_all();
  EXPECT_EQ(first_.machine.tick(), 2u);
  first_.advance(PeerProbes::kEvery);
  EXPECT_EQ(first_.take(Kind::kReport).back().report().unheard_size(), 0);
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
  grant.add_questions()->mutable_load();
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
    sum.add(hash_in(answers[0].answer()));
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
