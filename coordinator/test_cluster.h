// A coordinator among servers that are made of messages by hand, on a clock that tests set.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/test_requests.h"
#include "coordinator/world_registry.h"
#include "lpss/base/arithmetic_fingerprint.h"
#include "lpss/model/world_records.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"
#include "proto/wire.h"

namespace tessera {

// What a client has heard so far.
template <typename Answer>
struct Heard {
  std::optional<absl::Status> status;
  Answer answer;

  bool ok() const { return status && status->ok(); }
  absl::StatusCode code() const { return status ? status->code() : absl::StatusCode::kUnknown; }
  std::string message() const { return status ? std::string(status->message()) : "no reply yet"; }
};

using HeardReply = std::shared_ptr<Heard<v1::Reply>>;

class TestCluster {
 public:
  explicit TestCluster(CoordinatorOptions options = {})
      : coordinator(std::make_unique<Coordinator>(options)) {}

  static v1::Hello hello(Precision precision = Precision::kFloat32) {
    v1::Hello hello;
    hello.set_protocol(kClusterProtocol);
    hello.set_layout(wire_layout());
    hello.set_precision(to_proto(precision));
    hello.set_threads(2);
    hello.set_capacity(2);
    hello.set_stream_address("127.0.0.1:1");
    hello.set_arithmetic(arithmetic_fingerprint());
    return hello;
  }

  void join(NodeId node, const v1::Hello& hello) {
    v1::ClusterMessage message;
    *message.mutable_hello() = hello;
    receive(node, message);
  }
  void join(NodeId node, Precision precision = Precision::kFloat32) { join(node, hello(precision)); }

  void receive(NodeId from, const v1::ClusterMessage& message) {
    coordinator->receive(from, message, now);
    collect();
  }

  template <typename Answer, typename Request>
  std::shared_ptr<Heard<Answer>> ask(Request request, RequestId id = {}) {
    auto heard = std::make_shared<Heard<Answer>>();
    coordinator->handle(
        ClientCall<Request, Answer>{std::move(request),
                                    [heard](const absl::Status& status, const Answer& answer) {
                                      EXPECT_FALSE(heard->status) << "a second reply";
                                      heard->status = status;
                                      heard->answer = answer;
                                    },
                                    id, role},
        now);
    collect();
    return heard;
  }

  // A request of commands, ticks and queries.
  HeardReply send(const v1::Request& request, RequestId id = {}) { return ask<v1::Reply>(request, id); }
  HeardReply apply(const std::vector<v1::Command>& list, RequestId id = {}) {
    return send(request_of(list), id);
  }
  HeardReply apply(const v1::Command& command, RequestId id = {}) {
    return apply(std::vector<v1::Command>{command}, id);
  }
  HeardReply step(std::uint64_t ticks) { return send(request_of({}, ticks)); }
  HeardReply query(const std::vector<v1::Query>& list) { return send(request_of({}, 0, list)); }
  HeardReply query(const v1::Query& query) { return this->query(std::vector<v1::Query>{query}); }

  // What the coordinator knows by itself.
  v1::FoundBodies find_bodies(const v1::FindBodies& wanted = {}) {
    v1::Query query;
    *query.mutable_find_bodies() = wanted;
    return only_result(query).find_bodies();
  }
  v1::FoundJoints find_joints(const std::string& prefix = "") {
    v1::Query query;
    query.mutable_find_joints()->set_name_prefix(prefix);
    return only_result(query).find_joints();
  }
  v1::FoundFrames find_frames(const std::string& prefix = "") {
    v1::Query query;
    query.mutable_find_frames()->set_name_prefix(prefix);
    return only_result(query).find_frames();
  }

  void advance(Nanoseconds by) {
    now += by;
    coordinator->advance(now);
    collect();
  }

  // Moves what the coordinator has sent to the inboxes of the servers.
  void collect() {
    for (OutgoingMessage& message : coordinator->take_messages()) {
      inbox[message.to].push_back(std::move(message.message));
    }
  }

  // Takes the messages of one kind out of a server's inbox.
  std::vector<v1::ClusterMessage> take(NodeId node, v1::ClusterMessage::KindCase kind) {
    std::vector<v1::ClusterMessage> taken;
    std::vector<v1::ClusterMessage> left;
    for (v1::ClusterMessage& message : inbox[node])
      (message.kind_case() == kind ? taken : left).push_back(message);
    inbox[node] = std::move(left);
    return taken;
  }

  std::vector<v1::Grant> take_grants(NodeId node) {
    std::vector<v1::Grant> grants;
    for (const v1::ClusterMessage& message : take(node, v1::ClusterMessage::kGrant))
      grants.push_back(message.grant());
    return grants;
  }

  void loaded(NodeId node, std::uint64_t world, const std::string& error = "") {
    v1::ClusterMessage message;
    message.mutable_loaded()->set_world(world);
    message.mutable_loaded()->set_error(error);
    receive(node, message);
  }

  // All servers load what they were sent.
  void finish_loads() {
    for (const NodeId node : nodes()) {
      for (const v1::ClusterMessage& message : take(node, v1::ClusterMessage::kLoadWorld)) {
        tick[node] = 0;
        loaded(node, message.load_world().world());
      }
    }
  }

  void report(NodeId node, std::uint64_t world, Tick completed, std::vector<v1::TickReport> ticks = {}) {
    v1::ClusterMessage message;
    message.mutable_report()->set_world(world);
    message.mutable_report()->set_tick(completed);
    message.mutable_report()->set_map_epoch(map_epoch);
    for (v1::TickReport& report : ticks) *message.mutable_report()->add_ticks() = std::move(report);
    receive(node, message);
  }

  void leave(NodeId node) {
    v1::ClusterMessage message;
    message.mutable_goodbye()->set_reason("told to");
    receive(node, message);
  }

  // One server carries out the grants that it has, and answers queries with what it `knows`.
  std::vector<v1::Grant> work(NodeId node) {
    std::vector<v1::Grant> grants = take_grants(node);
    for (const v1::Grant& grant : grants) {
      std::vector<v1::TickReport> reports(grant.ticks());
      for (v1::TickReport& report : reports) {
        report.set_tick(++tick[node]);
        write(TickCounts{.clones = 1}, *report.mutable_counts());
        report.set_work_us(1000);
      }
      if (grant.ticks() > 0) report(node, grant.world(), tick[node], std::move(reports));
      for (const v1::Question& question : grant.questions()) {
        if (question.has_queries()) answer(node, grant.world(), question);
      }
    }
    return grants;
  }

  // All servers work until there is nothing left to do.
  void work_all() {
    for (bool any = true; any;) {
      any = false;
      for (const NodeId node : nodes()) any |= !work(node).empty();
    }
  }

  v1::StatusReply status() { return ask<v1::StatusReply>(v1::StatusRequest())->answer; }

  std::vector<NodeId> nodes() const {
    std::vector<NodeId> result;
    for (const auto& [node, messages] : inbox) result.push_back(node);
    return result;
  }

  std::unique_ptr<Coordinator> coordinator;
  Nanoseconds now{1'000'000'000};
  std::map<NodeId, std::vector<v1::ClusterMessage>> inbox;
  std::map<NodeId, Tick> tick;
  std::uint64_t map_epoch = 1;  // that servers say is in effect
  // The answer of a server to a query; without it, that of its hash is (tick, node), and others are empty.
  std::function<v1::PartialResult(NodeId, const v1::Query&)> knows;
  std::function<std::uint64_t(NodeId)> work_us;  // that a server's queries took; empty: none
  v1::Answer::Excess excess = v1::Answer::NONE;  // of all of them
  std::optional<ClientRole> role;                // of clients; none: the process itself asks

 private:
  v1::QueryResult only_result(const v1::Query& query) {
    const HeardReply heard = this->query(query);
    EXPECT_TRUE(heard->ok()) << heard->message();
    EXPECT_EQ(heard->answer.results_size(), 1);
    return heard->answer.results_size() == 1 ? heard->answer.results(0) : v1::QueryResult();
  }

  void answer(NodeId node, std::uint64_t world, const v1::Question& question) {
    v1::ClusterMessage message;
    v1::Answer& answer = *message.mutable_answer();
    answer.set_world(world);
    answer.set_question(question.id());
    answer.set_tick(tick[node]);
    answer.set_excess(excess);
    if (work_us) answer.set_work_us(work_us(node));
    for (const v1::Query& query : question.queries().all()) {
      v1::PartialResult& part = *answer.add_results();
      if (knows) {
        part = knows(node, query);
      } else if (query.has_hash()) {
        part.set_hash_low(tick[node]);
        part.set_hash_high(node.value);
      }
    }
    receive(node, message);
  }
};

inline constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline constexpr NodeId kFirst{100};
inline constexpr NodeId kSecond{200};

// A floor ("floor", id 1), a ball ("ball", id 2) in sector 0, a kinematic box ("lift", id 3) and a ball of
// unequal centre ("egg", id 4) in sector (5, 0, 0).
inline WorldDescription small_world() {
  WorldDescription world;
  world.name = "small";
  world.settings.sector_size = 100;
  world.settings.time_step = 0.01;
  world.shapes = {Shape{{{Box{{10, 10, 1}}, {}}}}, Shape{{{Sphere{0.5}, {}}}}};
  const auto add = [&](const char* name, Motion motion, ShapeId shape,
                       SectorIndex sector) -> BodyDescription& {
    BodyDescription& body = world.bodies.emplace_back();
    body.name = name;
    body.properties.motion = motion;
    body.properties.shape = shape;
    body.pose.position.sector = sector;
    return body;
  };
  add("floor", Motion::kStatic, 0, {});
  add("ball", Motion::kDynamic, 1, {}).pose.position.local = {0, 0, 5};
  add("lift", Motion::kKinematic, 0, {5, 0, 0});
  add("egg", Motion::kDynamic, 1, {5, 0, 0}).properties.centre = {0.25, 0, 0};
  return world;
}

// What a coordinator knows of a world that is loaded.
inline WorldRegistry registry_of(const WorldDescription& world) {
  return {world, records_of(world).value(), joint_records_of(world).value()};
}

// A cluster of two servers with a world, paused at tick 0.
inline std::unique_ptr<TestCluster> loaded_cluster(CoordinatorOptions options = {},
                                                   const WorldDescription& world = small_world(),
                                                   bool is_replay = false) {
  auto cluster = std::make_unique<TestCluster>(options);
  cluster->join(kFirst);
  cluster->join(kSecond);
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  request.set_replay(is_replay);
  const auto load = cluster->ask<v1::LoadReply>(request);
  cluster->finish_loads();
  EXPECT_TRUE(load->ok()) << load->message();
  cluster->inbox[kFirst].clear();
  cluster->inbox[kSecond].clear();
  return cluster;
}

}  // namespace tessera
