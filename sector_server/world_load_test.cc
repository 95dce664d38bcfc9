// Worlds are loaded, replaced and unloaded; what belongs to another one is kept, dropped or refused.
#include <functional>
#include <limits>

#include "proto/convert.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = v1::ClusterMessage::KindCase;

class WorldLoad : public testing::Test {
 protected:
  WorldLoad() {
    server_.start();
    server_.welcome();
  }

  // The answers to loads, as world and error.
  std::vector<std::pair<std::uint64_t, std::string>> answers() {
    std::vector<std::pair<std::uint64_t, std::string>> result;
    for (const v1::ClusterMessage& message : server_.take(Kind::kLoaded)) {
      result.emplace_back(message.loaded().world(), message.loaded().error());
    }
    return result;
  }

  // The error that a load is answered with; the server must live on.
  std::string error_of(const v1::LoadWorld& load) {
    server_.load(load);
    EXPECT_FALSE(server_.has_ended());
    EXPECT_EQ(server_.machine.machine_between_ticks(), nullptr);
    const auto heard = answers();
    return heard.size() == 1 ? heard[0].second : "";
  }

  static v1::LoadWorld alone(std::uint64_t number = kWorld) {
    return loads_of(small_tower(), {kFirst}, number)[0];
  }

  static v1::ClusterMessage round(std::uint64_t world, Tick tick, std::uint32_t number,
                                  const std::string& body = "") {
    v1::ClusterMessage message;
    message.mutable_round()->set_world(world);
    message.mutable_round()->set_tick(tick);
    message.mutable_round()->set_number(number);
    message.mutable_round()->set_body(body);
    return message;
  }

  TestServer server_;
};

TEST_F(WorldLoad, IsAnsweredAndTheStateOfTickZeroIsShown) {
  server_.load(alone());
  EXPECT_THAT(answers(), ElementsAre(std::pair(kWorld, "")));
  EXPECT_THAT(server_.observed, ElementsAre(0));
  EXPECT_NE(server_.machine.machine_between_ticks(), nullptr);
  EXPECT_EQ(server_.machine.tick(), 0u);
  EXPECT_EQ(server_.machine.last_tick(), nullptr);
  EXPECT_FALSE(server_.machine.work_left());
  EXPECT_THAT(server_.log, Contains(HasSubstr("6 bodies live here")));
}

TEST_F(WorldLoad, OfAWorldThatIsNotForThisServerIsRefused) {
  EXPECT_THAT(error_of(loads_of(small_tower(), {kSecond})[0]), HasSubstr("lacks this one"));
}

TEST_F(WorldLoad, OfWhatCannotBeReadIsRefused) {
  v1::LoadWorld load = alone();
  load.mutable_settings()->set_precision(static_cast<v1::Precision>(9));
  EXPECT_THAT(error_of(load), HasSubstr("precision = 9"));
  load = alone();
  load.mutable_records()->pop_back();
  EXPECT_THAT(error_of(load), HasSubstr("the bytes do not fit"));
  load = alone();
  load.mutable_joints()->push_back('x');
  EXPECT_NE(error_of(load), "");
  load = alone();
  load.mutable_shapes(0)->mutable_shape()->mutable_parts(0)->clear_geometry();
  EXPECT_NE(error_of(load), "");
  load = alone();
  load.add_splitters();
  load.clear_owners();
  EXPECT_THAT(error_of(load), HasSubstr("the sector map has 2 runs for 1 servers"));
  load = loads_of(small_tower(), {kFirst, kSecond, NodeId{300}})[0];
  load.clear_splitters();
  load.clear_owners();
  load.add_splitters()->set_i(5);
  load.add_splitters()->set_i(-5);
  EXPECT_THAT(error_of(load), HasSubstr("must ascend on the curve"));
  load = alone();
  load.clear_owners();
  load.add_owners(1);
  EXPECT_THAT(error_of(load), HasSubstr("none of the 1 servers"));
  load.add_owners(0);
  EXPECT_THAT(error_of(load), HasSubstr("1 runs, and owners for 2"));
}

// Whoever is taken for the coordinator cannot end a server otherwise than by a goodbye.
TEST_F(WorldLoad, OfWhatNoWorldHasIsRefused) {
  v1::LoadWorld load = alone();
  load.mutable_shapes()->RemoveLast();
  EXPECT_THAT(error_of(load), HasSubstr("there is no shape"));
  load = alone();
  *load.add_shapes() = load.shapes(0);
  EXPECT_THAT(error_of(load), HasSubstr("is there already"));
  load = alone();
  load.mutable_settings()->set_sector_size(0);
  EXPECT_THAT(error_of(load), HasSubstr("sector_size"));
  load = alone();
  load.set_radius_max(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(error_of(load), HasSubstr("the largest radius"));
  const std::vector<BodyRecord> records = unpack_records(alone().records()).value();
  const auto with = [&](const std::function<void(std::vector<BodyRecord>&)>& change) {
    std::vector<BodyRecord> changed = records;
    change(changed);
    v1::LoadWorld forged = alone();
    forged.set_records(pack(std::span<const BodyRecord>(changed)));
    return error_of(forged);
  };
  EXPECT_THAT(with([](auto& all) { all.push_back(all.back()); }), HasSubstr("the id is given twice"));
  EXPECT_THAT(with([](auto& all) { all.back().id = {}; }), HasSubstr("the id must be 1 to"));
  EXPECT_THAT(with([](auto& all) { all.back().state.position[1] = 1e300; }), HasSubstr("position"));
  EXPECT_THAT(with([](auto& all) { all.back().state.rotation[0] = 7; }), HasSubstr("orthonormal"));
  EXPECT_THAT(with([](auto& all) { all.back().properties.mass = -1; }), HasSubstr("mass"));
  JointRecord joint;
  joint.id = JointId{1};
  joint.properties.parent = BodyId{77};
  joint.properties.child = records.back().id;
  load = alone();
  load.set_joints(pack(std::span<const JointRecord>(&joint, 1)));
  EXPECT_THAT(error_of(load), HasSubstr("its static parent 77 is not there"));
}

TEST_F(WorldLoad, OfAnotherPrecisionThanTheProcessHasIsRefused) {
  server_.load(alone());
  v1::LoadWorld load = alone(kWorld + 1);
  load.mutable_settings()->set_precision(to_proto(Precision::kFloat64));
  server_.take(Kind::kLoaded);
  EXPECT_NE(error_of(load), "");
  server_.load(alone(kWorld + 2));
  EXPECT_THAT(answers(), ElementsAre(std::pair(kWorld + 2, ""))) << "the next one may be right again";
}

TEST_F(WorldLoad, ReplacesTheWorldBefore) {
  server_.load(alone());
  server_.grant(grant_of(1, 3));
  server_.work();
  ASSERT_EQ(server_.machine.tick(), 3u);
  server_.load(alone(kWorld + 1));
  EXPECT_EQ(server_.machine.tick(), 0u);
  server_.grant(grant_of(1, 2, {}, kWorld + 1));
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 2u);
  EXPECT_THAT(server_.observed, ElementsAre(0, 1, 2, 3, 0, 1, 2));
}

TEST_F(WorldLoad, OfAWorldThatWasAlreadyUnloadedIsForgotten) {
  server_.unload(kWorld);
  server_.load(alone(kWorld));
  EXPECT_THAT(answers(), IsEmpty());
  EXPECT_EQ(server_.machine.machine_between_ticks(), nullptr);
  server_.load(alone(kWorld + 1));
  EXPECT_THAT(answers(), ElementsAre(std::pair(kWorld + 1, "")));
}

TEST_F(WorldLoad, AnUnloadEndsTheWorldThatItNamesAndNoOther) {
  server_.load(alone());
  server_.unload(kWorld - 1);
  EXPECT_NE(server_.machine.machine_between_ticks(), nullptr);
  server_.unload(kWorld);
  EXPECT_EQ(server_.machine.machine_between_ticks(), nullptr);
  EXPECT_THAT(server_.log, Contains("the world is unloaded"));
  server_.advance(std::chrono::seconds(1));
  const auto reports = server_.take(Kind::kReport);
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].report().world(), 0u);
}

TEST_F(WorldLoad, WhatIsLateForAWorldThatIsGoneIsDropped) {
  server_.load(alone());
  server_.unload();
  server_.grant(grant_of(1, 5));
  for (std::uint32_t n = 0; n < 5000; ++n) {
    server_.receive(kSecond, round(kWorld, 1, n));
    server_.receive(kSecond, round(kWorld - 1, 1, n));
  }
  EXPECT_FALSE(server_.machine.work_left());
  EXPECT_FALSE(server_.has_ended());
  server_.load(alone(kWorld + 1));
  EXPECT_FALSE(server_.machine.work_left());
}

TEST_F(WorldLoad, WhatIsEarlyForAWorldWaitsForIt) {
  server_.grant(grant_of(1, 4, {}, kWorld + 1));
  server_.load(alone(kWorld));
  EXPECT_FALSE(server_.machine.work_left()) << "it is of the next world";
  server_.load(alone(kWorld + 1));
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 4u);
}

TEST_F(WorldLoad, WhatIsEarlyIsKeptUpToALimit) {
  for (int n = 0; n < 4096; ++n) server_.receive(kSecond, round(kWorld, 1, static_cast<std::uint32_t>(n)));
  EXPECT_FALSE(server_.has_ended());
  server_.receive(kSecond, round(kWorld, 2, 0));
  EXPECT_EQ(server_.failure().code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(WorldLoad, WhatAStrangerSendsIsIgnored) {
  server_.load(alone());
  server_.receive(NodeId{77}, round(kWorld, 1, 1));
  EXPECT_THAT(server_.log, Contains(HasSubstr("77, which is not a server of this world")));
  v1::ClusterMessage message;
  message.mutable_goodbye();
  server_.receive(NodeId{77}, message);
  message.mutable_refusal();
  server_.receive(kSecond, message);
  message.mutable_load_world()->set_world(kWorld + 1);
  server_.receive(kSecond, message);
  EXPECT_THAT(server_.log, Contains(HasSubstr("only a coordinator may send")).Times(3));
  EXPECT_FALSE(server_.has_ended());
  server_.grant(grant_of(1, 4));
  server_.work();
  EXPECT_EQ(server_.machine.tick(), 4u);
}

TEST_F(WorldLoad, ARoundThatComesTwiceOrTooLateIsIgnored) {
  server_.load(loads_of(small_tower(), {kFirst, kSecond})[0]);
  server_.receive(kSecond, round(kWorld, 1, 1));
  server_.receive(kSecond, round(kWorld, 1, 1));
  EXPECT_THAT(server_.log, Contains(HasSubstr("arrived twice")));
  server_.receive(kSecond, round(kWorld, 0, 1));
  EXPECT_THAT(server_.log, Contains(HasSubstr("of tick 0 arrived after tick 0")));
  EXPECT_FALSE(server_.has_ended());
}

TEST_F(WorldLoad, WhatCannotBeReadInATickEndsTheServer) {
  server_.load(alone());
  v1::Grant grant = grant_of(1, 1);
  grant.set_commands("garbage");
  server_.grant(grant);
  server_.work();
  EXPECT_EQ(server_.failure().code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(server_.machine.work_left()) << "nothing more is done";

  TestServer pair;
  pair.start();
  pair.welcome();
  pair.load(loads_of(small_tower(), {kFirst, kSecond})[0]);
  pair.grant(grant_of(1, 1));
  pair.work();
  ASSERT_FALSE(pair.to_peers.empty());
  const v1::Round& awaited = pair.to_peers.front().message.round();
  pair.receive(kSecond, round(kWorld, awaited.tick(), awaited.number(), "garbage"));
  pair.work();
  EXPECT_EQ(pair.failure().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace tessera
