// Sector servers without a network, on a clock that tests set: what goes in and what comes out is in the
// hands of the test.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/placement.h"
#include "lpss/engine/load_engine.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"
#include "proto/convert.h"
#include "proto/wire.h"
#include "sector_server/sector_server.h"

namespace tessera {

inline constexpr NodeId kFirst{100};
inline constexpr NodeId kSecond{200};
inline constexpr std::uint64_t kWorld = 3;  // the number of the world that tests load

// A message on its way to a server.
struct Letter {
  NodeId from;
  NodeId to;
  v1::ClusterMessage message;
};

class TestServer {
 public:
  using Kind = v1::ClusterMessage::KindCase;

  explicit TestServer(NodeId self = kFirst, SectorServerOptions options = {})
      : node(self),
        machine(
            with_log(std::move(options)), load_engine, [this] { return now; },
            [this](Tick tick, auto&) { observed.push_back(tick); }) {}

  void start() {
    machine.start(node, now);
    collect();
  }
  void receive(NodeId from, const v1::ClusterMessage& message) {
    machine.receive(from, message, now);
    collect();
  }
  void work() {
    while (machine.work_left()) machine.proceed(now);
    collect();
  }
  void advance(Nanoseconds by) {
    now += by;
    machine.advance(now);
    collect();
  }
  void suspect(NodeId other) {
    machine.suspect(other, now);
    collect();
  }

  void welcome(std::uint64_t heartbeat_ms = 500) {
    v1::ClusterMessage message;
    message.mutable_welcome()->set_heartbeat_ms(heartbeat_ms);
    receive(kCoordinatorNode, message);
  }
  void load(const v1::LoadWorld& world) {
    v1::ClusterMessage message;
    *message.mutable_load_world() = world;
    receive(kCoordinatorNode, message);
  }
  void unload(std::uint64_t world = kWorld) {
    v1::ClusterMessage message;
    message.mutable_unload_world()->set_world(world);
    receive(kCoordinatorNode, message);
  }
  void grant(const v1::Grant& grant) {
    v1::ClusterMessage message;
    *message.mutable_grant() = grant;
    receive(kCoordinatorNode, message);
  }

  // Takes the messages of one kind to the coordinator out of what was sent.
  std::vector<v1::ClusterMessage> take(Kind kind) {
    std::vector<v1::ClusterMessage> taken;
    std::vector<v1::ClusterMessage> left;
    for (v1::ClusterMessage& message : to_coordinator)
      (message.kind_case() == kind ? taken : left).push_back(message);
    to_coordinator = std::move(left);
    return taken;
  }

  // Why it ended; OK where it has not, or did so in order.
  absl::Status failure() const { return machine.finished().value_or(absl::OkStatus()); }
  bool has_ended() const { return machine.finished().has_value(); }

  const NodeId node;
  Nanoseconds now{1'000'000'000};
  std::vector<v1::ClusterMessage> to_coordinator;
  std::vector<Letter> to_peers;
  std::vector<Tick> observed;
  std::vector<std::string> log;
  SectorServer machine;

 private:
  SectorServerOptions with_log(SectorServerOptions options) {
    options.log = [this](const LogLine& line) { log.push_back(line.text); };
    return options;
  }

  void collect() {
    for (SectorServer::Outgoing& out : machine.take_messages()) {
      v1::ClusterMessage message;
      ASSERT_TRUE(message.ParseFromString(out.payload));
      if (out.to == kCoordinatorNode) {
        to_coordinator.push_back(std::move(message));
      } else {
        to_peers.push_back({node, out.to, std::move(message)});
      }
    }
  }
};

// What a coordinator sends so that `nodes` load the world; every tick is reported with its hash.
inline std::vector<v1::LoadWorld> loads_of(const WorldDescription& world, const std::vector<NodeId>& nodes,
                                           std::uint64_t number = kWorld) {
  const auto records = records_of(world);
  const auto joints = joint_records_of(world);
  EXPECT_TRUE(records.ok()) << records.status();
  EXPECT_TRUE(joints.ok()) << joints.status();
  std::vector<Host> hosts;
  for (const NodeId node : nodes) hosts.push_back({.node = node});
  const auto placement = place(number, {WorldToLoad::Described{world, *records, *joints}}, hosts);
  EXPECT_TRUE(placement.ok()) << placement.status();
  std::vector<v1::LoadWorld> loads = placement->loads;
  for (v1::LoadWorld& load : loads) load.set_hash_ticks(true);
  return loads;
}

// A tower across a border, such that each of two servers has a part of it.
inline WorldDescription small_tower() {
  WorldSettings settings;
  settings.sector_size = 4;
  return tower_world(settings, 6, {0, 0, -1});
}

inline v1::NumberedShape numbered(ShapeId id, Geometry geometry) {
  return to_proto(ShapeEntry{id, std::make_shared<const Shape>(Shape{{{std::move(geometry), {}}}})});
}

inline v1::Grant grant_of(std::uint64_t serial, std::uint64_t ticks,
                          std::initializer_list<std::uint64_t> hash_questions = {},
                          std::uint64_t world = kWorld) {
  v1::Grant grant;
  grant.set_world(world);
  grant.set_serial(serial);
  grant.set_ticks(ticks);
  grant.set_commands(pack(std::span<const Command>{}));
  for (const std::uint64_t id : hash_questions) {
    v1::Question& question = *grant.add_questions();
    question.set_id(id);
    question.mutable_queries()->add_all()->mutable_hash();
  }
  return grant;
}

inline v1::ClusterMessage message_of(const v1::Grant& grant) {
  v1::ClusterMessage message;
  *message.mutable_grant() = grant;
  return message;
}

// Of a server, in the answer to a query of its hash.
inline WorldHash hash_in(const v1::Answer& answer) {
  EXPECT_EQ(answer.results_size(), 1);
  return WorldHash(answer.results(0).hash_low(), answer.results(0).hash_high());
}

// The hash of the world after each of `ticks`, run in one process; `commands` act at the first of them.
inline std::vector<WorldHash> expected_hashes(const WorldDescription& world, Tick ticks,
                                              const std::vector<Command>& commands = {}) {
  const auto simulation = Simulation::create(world);
  EXPECT_TRUE(simulation.ok()) << simulation.status();
  std::vector<WorldHash> hashes;
  for (Tick tick = 1; tick <= ticks; ++tick) {
    (*simulation)->step(tick == 1 ? commands : std::vector<Command>{});
    hashes.push_back((*simulation)->hash());
  }
  return hashes;
}

// The hash of the world after each tick, from what its servers have reported.
inline std::vector<WorldHash> reported_hashes(const std::vector<TestServer*>& servers) {
  std::map<Tick, WorldHash> sums;
  for (TestServer* server : servers) {
    for (const v1::ClusterMessage& message : server->take(v1::ClusterMessage::kReport)) {
      for (const v1::TickReport& tick : message.report().ticks()) {
        sums[tick.tick()].add(WorldHash(tick.hash_low(), tick.hash_high()));
      }
    }
  }
  std::vector<WorldHash> hashes;
  for (const auto& [tick, hash] : sums) hashes.push_back(hash);
  return hashes;
}

}  // namespace tessera
