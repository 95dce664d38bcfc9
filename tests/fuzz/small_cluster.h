// A coordinator and a sector server in one thread, on a clock of their own.
#pragma once

#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "lpss/base/invariant.h"
#include "lpss/engine/load_engine.h"
#include "lpss/model/world_description.h"
#include "sector_server/sector_server.h"

namespace tessera::fuzz {

inline constexpr NodeId kServer{100};

// A floor, two balls and a kinematic box, with a hinge: something for each kind of request to name.
inline WorldDescription small_world() {
  WorldDescription world;
  world.name = "small";
  world.settings.sector_size = 20;
  world.shapes = {Shape{{{Box{{10, 10, 1}}, {}}}}, Shape{{{Sphere{0.5}, {}}}}};
  const auto add = [&](const char* name, Motion motion, ShapeId shape, const Eigen::Vector3d& at) {
    BodyDescription& body = world.bodies.emplace_back();
    body.name = name;
    body.properties.motion = motion;
    body.properties.shape = shape;
    body.pose.position.local = at;
  };
  add("floor", Motion::kStatic, 0, {0, 0, -1});
  add("ball", Motion::kDynamic, 1, {0, 0, 1});
  add("egg", Motion::kDynamic, 1, {2, 0, 1});
  add("lift", Motion::kKinematic, 0, {0, 8, 5});
  JointDescription& hinge = world.joints.emplace_back();
  hinge.name = "hinge";
  hinge.properties.type = JointType::kRevolute;
  hinge.properties.parent = BodyId{2};  // the second in the list
  hinge.properties.child = BodyId{3};
  hinge.properties.in_parent.position = {1, 0, 0};
  hinge.properties.in_child.position = {-1, 0, 0};
  return world;
}

class SmallCluster {
 public:
  SmallCluster()
      : server_(
            {}, load_engine, [this] { return now_; }, [](Tick, TickMachine&) {}),
        coordinator_(CoordinatorOptions{}) {
    server_.start(kServer, now_);
    deliver();
  }

  // Asks the coordinator, and lets both do what follows of it: for some turns, since a client may ask for any
  // number of ticks.
  template <typename Answer, typename Request>
  void ask(Request request) {
    auto answered = std::make_shared<bool>(false);
    const auto reply = [answered](const absl::Status&, const Answer&) {
      invariant(!std::exchange(*answered, true), "a call has one answer");
    };
    coordinator_.handle(ClientCall<Request, Answer>{std::move(request), reply}, now_);
    deliver();
    pass_time();
  }

  // A message that claims to come from this node.
  void to_coordinator(NodeId from, const v1::ClusterMessage& message) {
    coordinator_.receive(from, message, now_);
    deliver();
    pass_time();
  }
  void to_server(NodeId from, const v1::ClusterMessage& message) {
    server_.receive(from, message, now_);
    deliver();
    pass_time();
  }

 private:
  static constexpr int kTurnsMax = 64;

  void pass_time() {
    now_ += std::chrono::milliseconds(20);
    server_.advance(now_);
    coordinator_.advance(now_);
    deliver();
  }

  void deliver() {
    for (int turn = 0; turn < kTurnsMax; ++turn) {
      std::vector<OutgoingMessage> to_server = coordinator_.take_messages();
      for (OutgoingMessage& out : to_server) {
        if (out.to == kServer) server_.receive(kCoordinatorNode, std::move(out.message), now_);
      }
      if (server_.work_left()) server_.proceed(now_);
      const std::vector<SectorServer::Outgoing> to_coordinator = server_.take_messages();
      for (const SectorServer::Outgoing& out : to_coordinator) {
        v1::ClusterMessage message;
        invariant(message.ParseFromString(out.payload), "a server's messages can be read");
        if (out.to == kCoordinatorNode) coordinator_.receive(kServer, message, now_);
      }
      if (to_server.empty() && to_coordinator.empty() && !server_.work_left()) return;
    }
  }

  Nanoseconds now_{1'000'000'000};
  SectorServer server_;
  Coordinator coordinator_;
};

}  // namespace tessera::fuzz
