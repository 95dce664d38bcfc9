#include "ros/robots.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "daemon/log.h"
#include "ros/names.h"
#include "worlds/loader/model_file.h"

namespace tessera::ros {
namespace {

using JointStateMessage = sensor_msgs_msg_dds__JointState_;
using TwistMessage = geometry_msgs_msg_dds__Twist_;

constexpr std::size_t kFollowersMax = 64;  // models: each has three services
constexpr std::uint64_t kAsked = 100'000;  // the coordinator's maximum

bool is_one_of(const std::string& model, const std::vector<std::string>& models) {
  return models.empty() || std::ranges::find(models, model) != models.end();
}

bool is_finite(const TwistMessage& twist) {
  const auto& [linear, angular] = twist;
  return Eigen::Vector3d(linear.x, linear.y, linear.z).allFinite() &&
         Eigen::Vector3d(angular.x, angular.y, angular.z).allFinite();
}

// By wheels, which also tell how far they have come.
bool has_wheels(const FoundProgram& program) {
  return program.kind == "diff_drive" || program.kind == "ackermann";
}

bool is_driven_by_velocity(const FoundProgram& program) {
  return has_wheels(program) || program.kind == "treads" || program.kind == "velocity_control" ||
         program.kind == "multicopter";
}

// The inputs of a program for velocities in the body frame (m/s), and rates of turn (rad/s).
std::vector<NamedNumber> inputs_for(const FoundProgram& program, const TwistMessage& twist) {
  const auto& [linear, angular] = twist;
  if (program.kind == "velocity_control") {
    return {{"x", linear.x},       {"y", linear.y},       {"z", linear.z},
            {"turn_x", angular.x}, {"turn_y", angular.y}, {"turn_z", angular.z}};
  }
  if (program.kind == "multicopter")
    return {{"x", linear.x}, {"y", linear.y}, {"z", linear.z}, {"turn", angular.z}};
  const double speed = linear.x;
  const double turn = angular.z;
  if (program.kind != "ackermann") return {{"speed", speed}, {"turn", turn}};
  constexpr double kStands = 1e-3;  // m/s
  const double wheelbase = parameter_of(program, "wheelbase");
  const double angle = std::abs(speed) < kStands ? 0 : std::atan(turn * wheelbase / speed);
  return {{"speed", speed}, {"steer", angle}};
}

}  // namespace

Robots::Robots(Node& node, RobotOptions options, std::function<void()> on_command)
    : node_(node), options_(std::move(options)), on_command_(std::move(on_command)) {}

// Nobody may call it any more.
Robots::~Robots() {
  for (const auto& [topic, reader] : readers_) dds_delete(reader);
}

void Robots::forget() {
  for (const auto& [name, follower] : followers_) follower->forget();
  joints_.clear();
  states_.clear();
  servants_.clear();
  sensors_.clear();
  models_.clear();
  groups_.clear();
  efforts_.forget();
  published_ = 0;
}

std::string Robots::name_space(const std::string& model) const {
  return model == options_.root ? "/" : absl::StrCat("/", topic_word(model), "/");
}

std::optional<Robots::Bridged> Robots::bridged(const dds_topic_descriptor_t& type, OwnTopic topic,
                                               Flow flow) {
  if (options_.bridge == nullptr) return Bridged{topic.topic, Profile{}};
  topic.type = ros_type(type.m_typename);
  topic.flow = flow;
  const BridgeEntry* const entry = options_.bridge->find(topic, model_names_);
  if (entry == nullptr) return std::nullopt;
  return Bridged{entry->ros_topic,
                 {.depth = flow == Flow::kToRos ? entry->publisher_queue : entry->subscriber_queue}};
}

absl::StatusOr<dds_entity_t> Robots::writer(const dds_topic_descriptor_t& type, OwnTopic topic) {
  const std::optional<Bridged> bridge = bridged(type, std::move(topic), Flow::kToRos);
  if (!bridge) return 0;
  const auto [entry, is_new] = writers_.try_emplace({&type, bridge->topic});
  if (!is_new) return entry->second;
  absl::StatusOr<dds_entity_t> made = node_.writer(type, bridge->topic, bridge->profile);
  if (!made.ok()) {
    writers_.erase(entry);
    return made;
  }
  return entry->second = *made;
}

absl::StatusOr<dds_entity_t> Robots::reader(const dds_topic_descriptor_t& type, OwnTopic topic) {
  const std::optional<Bridged> bridge = bridged(type, std::move(topic), Flow::kFromRos);
  return bridge ? open_reader(type, *bridge) : absl::StatusOr<dds_entity_t>(0);
}

absl::StatusOr<dds_entity_t> Robots::open_reader(const dds_topic_descriptor_t& type, const Bridged& bridge) {
  const auto [entry, is_new] = readers_.try_emplace({&type, bridge.topic});
  if (!is_new) return entry->second;
  const auto on_data = [this] {
    commanded_ = true;
    on_command_();
  };
  absl::StatusOr<dds_entity_t> made = node_.reader(type, bridge.topic, on_data, bridge.profile);
  if (!made.ok()) {
    readers_.erase(entry);
    return made;
  }
  return entry->second = *made;
}

absl::Status Robots::learn(Client& client, const std::vector<std::string>& models, absl::Duration timeout) {
  QueryList queries;
  const auto programs = queries.programs({.limit = kAsked});
  const auto joints = queries.find_joints("", kAsked);
  const absl::StatusOr<Answers> answers = client.ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  const FoundPrograms found = (*answers)[programs];
  const std::vector<Sensor> before = std::move(sensors_);
  sensors_.clear();
  models_.clear();
  servants_.clear();
  model_names_.clear();
  joints_ = (*answers)[joints].joints;
  std::erase_if(joints_,
                [&](const FoundJoint& joint) { return !is_one_of(model_of(joint.joint.name), models); });
  for (const FoundProgram& program : found.programs) model_names_.insert(model_of(program.body_name));
  for (const FoundJoint& joint : joints_) model_names_.insert(model_of(joint.joint.name));
  if (absl::Status status = add_sensors(found.programs, models); !status.ok()) return status;
  // What they have measured counts until they measure again.
  for (Sensor& sensor : sensors_) {
    const auto same = std::ranges::find_if(before, [&](const Sensor& other) {
      return other.program.body == sensor.program.body && other.program.program == sensor.program.program;
    });
    if (same != before.end()) sensor.values = same->values;
  }
  if (absl::Status status = add_joints(); !status.ok()) return status;
  if (absl::Status status = add_groups(); !status.ok()) return status;
  if (options_.bridge != nullptr) {
    for (const std::string& unused : options_.bridge->take_unused()) log_warning(unused);
  }
  return absl::OkStatus();
}

absl::Status Robots::add_sensors(const std::vector<FoundProgram>& programs,
                                 const std::vector<std::string>& models) {
  std::set<std::string> topics;
  for (const FoundProgram& program : programs) {
    const std::string model = model_of(program.body_name);
    if (!is_one_of(model, models)) continue;
    if (program.kind == "pid") {
      if (const double joint = parameter_of(program, "joint"); joint > 0)
        servants_.emplace(static_cast<std::uint64_t>(joint), program);
    }
    if (is_driven_by_velocity(program)) models_[model].drives.push_back(program);
    const std::span<const SensorKind> kinds = sensor_kinds(program);
    if (kinds.empty()) continue;
    // Programs for Gazebo's wheels have the names of their plugins, which are no topics.
    const bool is_named = !program.name.empty() && !has_wheels(program);
    const std::string word = is_named ? topic_word(program.name) : std::string(kinds.front().name);
    const std::string above = name_space(model);
    std::string topic = absl::StrCat(above, word);
    if (topics.contains(topic))
      topic = absl::StrCat(above, topic_word(rest_of(program.body_name)), "/", word);
    for (int number = 2; !topics.insert(topic).second; ++number)
      topic = absl::StrCat(above, topic_word(rest_of(program.body_name)), "/", word, "_", number);
    const std::string body_frame = frame_name(program.body_name, options_.root);
    const bool is_mounted = frame_in_body(program).has_value();
    const bool is_way = kinds.front().type == &nav_msgs_msg_dds__Odometry__desc;
    const std::string frame = is_mounted ? absl::StrCat(body_frame, "/", word)
                              : is_way
                                  ? absl::StrCat(model == options_.root ? "" : absl::StrCat(model, "/"), word)
                                  : body_frame;
    for (const SensorKind& kind : kinds) {
      Sensor sensor{program, &kind, absl::StrCat(topic, kind.part), frame, body_frame};
      if (has_image(program)) absl::StrAppend(&sensor.frame, "_optical_frame");
      const absl::StatusOr<dds_entity_t> made = writer(
          *kind.type,
          {.topic = sensor.topic, .model = model, .sensor = word, .names = names_in_gazebo(kind, word)});
      if (!made.ok()) return made.status();
      if (*made == 0 && !has_wheels(program)) continue;
      sensor.writer = *made;
      sensors_.push_back(std::move(sensor));
    }
  }
  return absl::OkStatus();
}

absl::Status Robots::add_joints() {
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    if (joints_[n].joint.properties.type == JointType::kFixed) continue;
    models_[model_of(joints_[n].joint.name)].joints.push_back(n);
  }
  for (auto& [name, model] : models_) {
    const std::string above = name_space(name);
    if (!model.joints.empty()) {
      const auto states =
          writer(sensor_msgs_msg_dds__JointState__desc, {.topic = absl::StrCat(above, "joint_states"),
                                                         .model = name,
                                                         .names = {"joint_state", "joint_states"},
                                                         .is_only_one = true});
      const auto commands = reader(sensor_msgs_msg_dds__JointState__desc,
                                   {.topic = absl::StrCat(above, "joint_command"), .model = name});
      if (!states.ok()) return states.status();
      if (!commands.ok()) return commands.status();
      model.states = *states;
      model.commands = *commands;
      if (absl::Status status = add_follower(name); !status.ok()) return status;
    }
    if (!model.drives.empty()) {
      const auto velocity =
          reader(geometry_msgs_msg_dds__Twist__desc, {.topic = absl::StrCat(above, "cmd_vel"),
                                                      .model = name,
                                                      .names = {"cmd_vel"},
                                                      .is_only_one = true});
      if (!velocity.ok()) return velocity.status();
      model.velocity = *velocity;
    }
  }
  return absl::OkStatus();
}

absl::Status Robots::add_groups() {
  groups_.clear();
  if (options_.controllers) {
    for (const JointGroup& group : *options_.controllers) {
      std::vector<std::size_t> joints = joints_of(group);
      if (joints.empty()) continue;
      if (absl::Status status = add_group(group.topic, group.mode, std::move(joints)); !status.ok())
        return status;
    }
    return absl::OkStatus();
  }
  if (options_.bridge != nullptr) return add_joint_topics();
  for (const auto& [name, model] : models_) {
    if (model.joints.empty()) continue;
    for (const auto& [controller, mode] : {std::pair{"position_controller", DriveMode::kPosition},
                                           std::pair{"velocity_controller", DriveMode::kVelocity},
                                           std::pair{"effort_controller", DriveMode::kEffort}}) {
      const std::string topic = absl::StrCat(name_space(name), controller, "/commands");
      if (absl::Status status = add_group(topic, mode, model.joints); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

absl::Status Robots::add_group(const std::string& topic, DriveMode mode, std::vector<std::size_t> joints) {
  const auto commands = open_reader(std_msgs_msg_dds__Float64MultiArray__desc, Bridged{topic, Profile{}});
  if (!commands.ok()) return commands.status();
  groups_.push_back({topic, *commands, mode, std::move(joints)});
  return absl::OkStatus();
}

absl::Status Robots::add_joint_topics() {
  for (const auto& [name, model] : models_) {
    for (const std::size_t place : model.joints) {
      const std::string joint = rest_of(joints_[place].joint.name);
      for (const auto& [command, mode] :
           {std::pair{"0/cmd_pos", DriveMode::kPosition}, std::pair{"cmd_vel", DriveMode::kVelocity},
            std::pair{"cmd_force", DriveMode::kEffort}}) {
        const std::string below = absl::StrCat("joint/", joint, "/", command);
        const std::string topic = absl::StrCat(name_space(name), below);
        const auto commands =
            reader(std_msgs_msg_dds__Float64__desc, {.topic = topic, .model = name, .names = {below}});
        if (!commands.ok()) return commands.status();
        if (*commands != 0) groups_.push_back({topic, *commands, mode, {place}, /*is_number=*/true});
      }
    }
  }
  return absl::OkStatus();
}

std::vector<std::size_t> Robots::joints_of(const JointGroup& group) const {
  std::vector<std::size_t> places;
  for (const auto& [name, model] : models_) {
    std::vector<std::size_t> found;
    for (const std::string& joint : group.joints) {
      if (const std::optional<std::size_t> place = place_of_joint(model, joint)) found.push_back(*place);
    }
    if (found.size() != group.joints.size()) continue;
    // One whose name is the namespace of the controller comes before all others.
    if (absl::StartsWith(group.topic, absl::StrCat("/", topic_word(name), "/"))) return found;
    if (!places.empty()) {
      log_warning(absl::StrCat("several models have the joints of ", group.topic, ": the first one has it"));
      break;
    }
    places = std::move(found);
  }
  if (places.empty()) log_warning(absl::StrCat("no model has the joints of ", group.topic));
  return places;
}

absl::Status Robots::add_follower(const std::string& model) {
  if (followers_.contains(model)) return absl::OkStatus();
  if (followers_.size() == kFollowersMax) {
    log_warning(absl::StrCat("only ", kFollowersMax, " models follow trajectories of joints: not ", model));
    return absl::OkStatus();
  }
  const std::string above = name_space(model);
  const OwnTopic topic = {.topic = absl::StrCat(above, "joint_trajectory_controller/joint_trajectory"),
                          .model = model,
                          .names = {"joint_trajectory"},
                          .is_only_one = true};
  const auto bridge = bridged(trajectory_msgs_msg_dds__JointTrajectory__desc, topic, Flow::kFromRos);
  const auto on_data = [this] {
    commanded_ = true;
    on_command_();
  };
  absl::StatusOr<std::unique_ptr<Follower>> follower =
      Follower::open(node_, above, bridge ? bridge->topic : topic.topic, on_data);
  if (!follower.ok()) return follower.status();
  followers_[model] = *std::move(follower);
  return absl::OkStatus();
}

std::vector<BodyId> Robots::measuring_bodies() const {
  std::set<BodyId> bodies;
  for (const Sensor& sensor : sensors_) bodies.insert(sensor.program.body);
  return {bodies.begin(), bodies.end()};
}

std::vector<FoundFrame> Robots::frames() const {
  std::vector<FoundFrame> frames;
  for (const Sensor& sensor : sensors_) {
    if (!frames.empty() && frames.back().name == sensor.frame) continue;  // another topic of it
    if (const std::optional<Pose> mounting = frame_in_body(sensor.program))
      frames.push_back({sensor.frame, sensor.program.body, sensor.program.body_name, *mounting});
  }
  return frames;
}

std::vector<TransformStamped> Robots::ways(Tick tick, double time_step) const {
  std::vector<TransformStamped> ways;
  for (const Sensor& sensor : sensors_) {
    if (sensor.values.empty() || !has_wheels(sensor.program)) continue;
    const double half = value_of(sensor, "heading") / 2;
    ways.push_back({.header = {.stamp = time_at(tick, time_step), .frame_id = text(sensor.frame)},
                    .child_frame_id = text(sensor.body_frame),
                    .transform = {.translation = {value_of(sensor, "x"), value_of(sensor, "y"), 0},
                                  .rotation = {0, 0, std::sin(half), std::cos(half)}}});
  }
  return ways;
}

void Robots::take(const ProgramFrame& frame) {
  for (const ProgramSample& sample : frame.programs) {
    for (Sensor& sensor : sensors_) {
      if (sensor.program.body == sample.body && sensor.program.program == sample.program)
        sensor.values = sample.values;
    }
  }
}

void Robots::take(JointFrame frame) {
  for (const JointSample& sample : frame.joints) states_[sample.id.value] = sample.state;
}

void Robots::publish(Tick tick, double time_step) {
  const Time stamp = time_at(tick, time_step);
  for (const Sensor& sensor : sensors_) {
    if (sensor.writer == 0 || !has_measured(sensor) || !measures_since(sensor, published_, tick, time_step))
      continue;
    warn(sensor.kind->publish(sensor, stamp));
  }
  for (const auto& [name, model] : models_) {
    if (model.states != 0) warn(publish_joints(name, model, stamp));
  }
  published_ = tick;
}

absl::Status Robots::publish_joints(const std::string& name, const Model& model, const Time& stamp) const {
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<double> velocities;
  std::vector<double> efforts;
  for (const std::size_t place : model.joints) {
    const auto state = states_.find(joints_[place].id.value);
    if (state == states_.end()) continue;
    names.push_back(rest_of(joints_[place].joint.name));
    positions.push_back(state->second.position[0]);
    velocities.push_back(state->second.velocity[0]);
    if (const std::optional<double> effort = efforts_.of(joints_[place].id)) efforts.push_back(*effort);
  }
  if (names.empty()) return absl::OkStatus();
  std::vector<char*> texts;
  for (std::string& one : names) texts.push_back(one.data());
  const auto count = static_cast<std::uint32_t>(names.size());
  JointStateMessage message{};
  std::string no_frame;
  message.header = {stamp, no_frame.data()};
  message.name = {count, count, texts.data(), /*_release=*/false};
  message.position = {count, count, positions.data(), /*_release=*/false};
  message.velocity = {count, count, velocities.data(), /*_release=*/false};
  // All or none.
  if (efforts.size() == names.size()) message.effort = {count, count, efforts.data(), /*_release=*/false};
  return write(model.states, &message, absl::StrCat(name_space(name), "joint_states"));
}

void Robots::ask_efforts(Client& client) {
  std::vector<JointId> joints;
  for (const auto& [name, model] : models_) {
    if (model.states == 0 || !has_reader(model.states)) continue;
    for (const std::size_t place : model.joints) joints.push_back(joints_[place].id);
  }
  efforts_.ask(client, std::move(joints));
}

std::optional<std::size_t> Robots::place_of_joint(const Model& model, const std::string& name) const {
  const auto place = std::ranges::find_if(
      model.joints, [&](std::size_t joint) { return rest_of(joints_[joint].joint.name) == name; });
  return place == model.joints.end() ? std::nullopt : std::optional(*place);
}

const FoundJoint* Robots::joint_named(const Model& model, const std::string& name) const {
  const std::optional<std::size_t> place = place_of_joint(model, name);
  return place ? &joints_[*place] : nullptr;
}

Follower::Where Robots::places_of(const std::string& model) const {
  return [this, model](const std::string& name) -> std::optional<double> {
    const auto found = models_.find(model);
    const FoundJoint* const joint = found == models_.end() ? nullptr : joint_named(found->second, name);
    if (joint == nullptr) return std::nullopt;
    const auto state = states_.find(joint->id.value);
    return state == states_.end() ? 0 : state->second.position[0];
  };
}

void Robots::follow(Client& client, Tick tick, double time_step) {
  for (const auto& [name, follower] : followers_) {
    const auto model = models_.find(name);
    if (model == models_.end()) {
      follower->forget();
      continue;
    }
    CommandList commands;
    for (const auto& [joint, position] : follower->next(tick, time_step, places_of(name))) {
      if (const FoundJoint* const found = joint_named(model->second, joint))
        command_joint(*found, DriveMode::kPosition, position, commands);
    }
    send(client, std::move(commands));
  }
}

void Robots::send(Client& client, CommandList commands) {
  if (commands.size() == 0) return;
  Batch batch;
  batch.commands = std::move(commands);
  client.send(batch, [](const absl::StatusOr<Answers>& answers) { warn(answers.status()); });
}

void Robots::carry_out(Client& client, Tick tick, double time_step) {
  commanded_ = false;
  for (const auto& [name, follower] : followers_) follower->take(tick, time_step, places_of(name));
  for (const auto& [name, model] : models_) {
    CommandList commands;
    if (model.velocity > 0) command_drives(model, commands);
    if (model.commands > 0) command_joints(model, commands);
    send(client, std::move(commands));
  }
  for (const Group& group : groups_) {
    CommandList commands;
    command_group(group, commands);
    send(client, std::move(commands));
  }
}

// The last message counts. A number that is not finite is no command.
void Robots::command_group(const Group& group, CommandList& commands) const {
  using Number = std_msgs_msg_dds__Float64_;
  using Numbers = std_msgs_msg_dds__Float64MultiArray_;
  std::optional<std::vector<double>> last;
  if (group.is_number) {
    take_all<Number>(group.commands, [&](const Number& message) { last = {message.data}; });
  } else {
    take_all<Numbers>(group.commands, [&](const Numbers& message) {
      last.emplace(message.data._buffer, message.data._buffer + message.data._length);
    });
  }
  if (!last) return;
  if (last->size() != group.joints.size()) {
    log_warning(absl::StrCat(group.topic, ": ", last->size(), " numbers, but ", group.joints.size(),
                             " joints: the command is ignored"));
    return;
  }
  for (std::size_t n = 0; n < last->size(); ++n) {
    if (std::isfinite((*last)[n])) command_joint(joints_[group.joints[n]], group.mode, (*last)[n], commands);
  }
}

void Robots::command_drives(const Model& model, CommandList& commands) {
  std::optional<TwistMessage> last;
  take_all<TwistMessage>(model.velocity, [&](const TwistMessage& message) { last = message; });
  if (!last || !is_finite(*last)) return;
  for (const FoundProgram& drive : model.drives)
    commands.tell_program(drive.body, inputs_for(drive, *last), drive.program);
}

void Robots::command_joints(const Model& model, CommandList& commands) const {
  take_all<JointStateMessage>(model.commands, [&](const JointStateMessage& message) {
    for (std::uint32_t n = 0; n < message.name._length; ++n) {
      const std::string name = message.name._buffer[n];
      const FoundJoint* const joint = joint_named(model, name);
      if (joint == nullptr) {
        log_warning(
            absl::StrCat("/joint_command names the joint \"", name, "\", which its model does not have"));
        continue;
      }
      for (const auto& [numbers, mode] : {std::pair{&message.position, DriveMode::kPosition},
                                          std::pair{&message.velocity, DriveMode::kVelocity},
                                          std::pair{&message.effort, DriveMode::kEffort}}) {
        if (n >= numbers->_length || !std::isfinite(numbers->_buffer[n])) continue;
        command_joint(*joint, mode, numbers->_buffer[n], commands);
        break;
      }
    }
  });
}

// By its controller, where it has one for that; or else by its drive.
void Robots::command_joint(const FoundJoint& joint, DriveMode mode, double target,
                           CommandList& commands) const {
  const auto servant = servants_.find(joint.id.value);
  if (servant == servants_.end()) {
    commands.set_drive(joint.id, {mode, target});
    return;
  }
  const FoundProgram& pid = servant->second;
  const char* const input = mode == DriveMode::kEffort ? "effort" : "set_point";
  const bool is_of_rate = parameter_of(pid, "of_rate") > 0;
  if (mode != DriveMode::kEffort && is_of_rate != (mode == DriveMode::kVelocity)) {
    log_warning(
        absl::StrCat("joint ", joint.joint.name, " is controlled by its ", is_of_rate ? "rate" : "position"));
    return;
  }
  commands.tell_program(pid.body, {{input, target}}, pid.program);
}

}  // namespace tessera::ros
