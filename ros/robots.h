// Sensors, wheels and joints of a world as topics of ROS 2, and what ROS commands.
//
// The topics of a model are below its name: "/robot/scan" of the program "scan" of a body of the model
// "robot"; or "/scan", where that model is the root.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "ros/bridge.h"
#include "ros/follower.h"
#include "ros/joint_efforts.h"
#include "ros/joint_groups.h"
#include "ros/node.h"
#include "ros/sensors.h"
#include "ros/transforms.h"
#include "tessera/client.h"
#include "tessera/joints.h"
#include "tessera/stream.h"

namespace tessera::ros {

struct RobotOptions {
  std::string root;  // a model whose topics and frames are without its name; empty: none
  // Controllers of joints. None: each model with joints has one for positions, velocities and efforts each,
  // of all its joints.
  std::optional<std::vector<JointGroup>> controllers;
  // Which topics there are, and under which names. Null: all, under their own. Must live longer.
  Bridge* bridge = nullptr;
};

// For one thread, but for `on_command`.
class Robots {
 public:
  // `on_command` is called, on a thread of DDS, when ROS has commanded something. `node` must live longer.
  Robots(Node& node, RobotOptions options, std::function<void()> on_command);
  ~Robots();
  Robots(const Robots&) = delete;
  Robots& operator=(const Robots&) = delete;

  // Those of another world, or of this one as it is now. Empty `models`: all. Topics that are no longer
  // needed stay, and are silent.
  absl::Status learn(Client& client, const std::vector<std::string>& models, absl::Duration timeout);
  void forget();

  const std::vector<FoundJoint>& joints() const { return joints_; }
  // With programs that measure; ascending.
  std::vector<BodyId> measuring_bodies() const;
  // Frames of sensors, which are fixed to their bodies.
  std::vector<FoundFrame> frames() const;

  // Where the wheels of robots have taken them: from the frame "odom" to that of their bodies.
  std::vector<TransformStamped> ways(Tick tick, double time_step) const;

  void take(const ProgramFrame& frame);
  void take(JointFrame frame);
  // All that is measured, with the time of a tick; a sensor with a rate as often as it measures.
  void publish(Tick tick, double time_step);

  // Asks for the efforts of joints whose states somebody reads.
  void ask_efforts(Client& client);

  bool is_commanded() const { return commanded_; }
  // Sends what ROS has commanded; `tick` is the latest that is known.
  void carry_out(Client& client, Tick tick, double time_step);
  // Sends where joints should be that follow trajectories.
  void follow(Client& client, Tick tick, double time_step);

 private:
  struct Model {
    dds_entity_t states = 0;    // joint_states
    dds_entity_t commands = 0;  // joint_command
    dds_entity_t velocity = 0;  // cmd_vel
    std::vector<std::size_t> joints;
    std::vector<FoundProgram> drives;  // that a velocity commands
  };
  // A group of joints that is commanded, by their places in joints_.
  struct Group {
    const std::string topic;
    dds_entity_t commands = 0;
    DriveMode mode = DriveMode::kPosition;
    std::vector<std::size_t> joints;
    bool is_number = false;  // a Float64 for its one joint, and no array
  };
  struct Bridged {
    std::string topic;  // of ROS
    Profile profile;
  };
  // By (type, topic), of this node: they are made once.
  using Entities = std::map<std::pair<const dds_topic_descriptor_t*, std::string>, dds_entity_t>;

  std::string name_space(const std::string& model) const;
  // What ROS has of a topic; nothing where it is not bridged.
  std::optional<Bridged> bridged(const dds_topic_descriptor_t& type, OwnTopic topic, Flow flow);
  // 0 where it is not bridged.
  absl::StatusOr<dds_entity_t> writer(const dds_topic_descriptor_t& type, OwnTopic topic);
  absl::StatusOr<dds_entity_t> reader(const dds_topic_descriptor_t& type, OwnTopic topic);
  absl::StatusOr<dds_entity_t> open_reader(const dds_topic_descriptor_t& type, const Bridged& bridge);
  absl::Status add_sensors(const std::vector<FoundProgram>& programs, const std::vector<std::string>& models);
  absl::Status add_joints();
  absl::Status add_groups();
  // With a bridge: a number for each joint, as Gazebo's controllers have it.
  absl::Status add_joint_topics();
  absl::Status add_group(const std::string& topic, DriveMode mode, std::vector<std::size_t> joints);
  // The places of the joints of a group in the one model that has them all; empty: there is none.
  std::vector<std::size_t> joints_of(const JointGroup& group) const;
  absl::Status publish_joints(const std::string& name, const Model& model, const Time& stamp) const;
  absl::Status add_follower(const std::string& model);
  static void send(Client& client, CommandList commands);
  static void command_drives(const Model& model, CommandList& commands);
  void command_joints(const Model& model, CommandList& commands) const;
  void command_group(const Group& group, CommandList& commands) const;
  // Of a model: where its joints are.
  Follower::Where places_of(const std::string& model) const;
  std::optional<std::size_t> place_of_joint(const Model& model, const std::string& name) const;
  const FoundJoint* joint_named(const Model& model, const std::string& name) const;
  void command_joint(const FoundJoint& joint, DriveMode mode, double target, CommandList& commands) const;

  Node& node_;
  const RobotOptions options_;
  const std::function<void()> on_command_;
  std::atomic<bool> commanded_ = false;
  Entities writers_;
  Entities readers_;
  std::vector<FoundJoint> joints_;
  absl::flat_hash_map<std::uint64_t, JointState> states_;      // by id
  absl::flat_hash_map<std::uint64_t, FoundProgram> servants_;  // programs pid, by the joint that they drive
  std::vector<Sensor> sensors_;
  std::map<std::string, Model> models_;
  std::set<std::string> model_names_;
  std::vector<Group> groups_;
  JointEfforts efforts_;
  std::map<std::string, std::unique_ptr<Follower>>
      followers_;       // by model; those that have gone stay, and rest
  Tick published_ = 0;  // the tick of the last publication
};

}  // namespace tessera::ros
