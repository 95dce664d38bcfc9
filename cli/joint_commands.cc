// Joints of a running world: where they stand, and what drives them.
#include <absl/strings/numbers.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "cli/connection.h"
#include "cli/terminal.h"

namespace tessera::cli {
namespace {

const char* name_of(JointType type) {
  switch (type) {
    case JointType::kFixed:
      return "fixed";
    case JointType::kRevolute:
      return "revolute";
    case JointType::kPrismatic:
      return "prismatic";
    case JointType::kBall:
      return "ball";
    case JointType::kUniversal:
      return "universal";
    case JointType::kScrew:
      return "screw";
  }
  return "unknown";
}

const char* name_of(DriveMode mode) {
  switch (mode) {
    case DriveMode::kFree:
      return "free";
    case DriveMode::kVelocity:
      return "velocity";
    case DriveMode::kPosition:
      return "position";
    case DriveMode::kEffort:
      return "effort";
    case DriveMode::kServo:
      return "servo";
  }
  return "unknown";
}

absl::StatusOr<DriveMode> parse_mode(const std::string& text) {
  for (const DriveMode mode : {DriveMode::kFree, DriveMode::kVelocity, DriveMode::kPosition,
                               DriveMode::kEffort, DriveMode::kServo}) {
    if (text == name_of(mode)) return mode;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("\"", text, "\" is none of free, velocity, position, effort and servo"));
}

// A number is an id, all else a name.
JointName parse_joint(const std::string& text) {
  std::uint64_t id = 0;
  const bool digits = std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (digits && absl::SimpleAtoi(text, &id)) return JointId{id};
  return text;
}

// "0.100, -0.200", one number an axis.
std::string axes_text(const std::array<double, 2>& values, int axes) {
  return absl::StrJoin(values.begin(), values.begin() + axes, ", ",
                       [](std::string* out, double value) { absl::StrAppendFormat(out, "%.3f", value); });
}

std::string drives_text(const JointDrives& drives, int axes) {
  return absl::StrJoin(drives.begin(), drives.begin() + axes, ", ",
                       [](std::string* out, const JointDrive& drive) {
                         absl::StrAppend(out, name_of(drive.mode));
                         if (drive.mode != DriveMode::kFree) absl::StrAppendFormat(out, " %g", drive.target);
                       });
}

std::vector<std::string> to_row(const FoundJoint& joint, const JointState& state) {
  const JointType type = joint.joint.properties.type;
  const int axes = axis_count(type);
  return {absl::StrCat(joint.id.value),
          joint.joint.name,
          name_of(type),
          joint.parent.empty() ? "world" : joint.parent,
          joint.child,
          axes_text(state.position, axes),
          axes_text(state.velocity, axes),
          axes == 0                       ? ""
          : type == JointType::kPrismatic ? "m"
                                          : "rad",
          absl::StrFormat("%.1e m", state.gap),
          drives_text(joint.joint.drives, axes)};
}

nlohmann::json json_of(const FoundJoint& joint, const JointState& state) {
  const auto axes = static_cast<std::size_t>(axis_count(joint.joint.properties.type));
  nlohmann::json result = {{"id", joint.id.value},
                           {"name", joint.joint.name},
                           {"type", name_of(joint.joint.properties.type)},
                           {"parent", joint.parent},
                           {"child", joint.child},
                           {"gap", state.gap},
                           {"twist", state.twist},
                           {"position", nlohmann::json::array()},
                           {"velocity", nlohmann::json::array()},
                           {"drives", nlohmann::json::array()}};
  for (std::size_t axis = 0; axis < axes; ++axis) {
    const JointDrive& drive = joint.joint.drives[axis];
    result["position"].push_back(state.position[axis]);
    result["velocity"].push_back(state.velocity[axis]);
    nlohmann::json shown = {{"mode", name_of(drive.mode)}, {"target", drive.target}};
    if (drive.mode == DriveMode::kServo) {
      shown["stiffness"] = drive.stiffness;
      shown["damping"] = drive.damping;
      shown["velocity"] = drive.velocity;
      shown["effort"] = drive.effort;
    }
    result["drives"].push_back(std::move(shown));
  }
  return result;
}

absl::Status show_joints(Client& client, const std::string& prefix, std::uint64_t limit,
                         nlohmann::json& data) {
  const absl::StatusOr<FoundJoints> found = client.find_joints(prefix, limit);
  if (!found.ok()) return found.status();
  data = {{"joints", nlohmann::json::array()}, {"truncated", found->truncated}};
  if (found->joints.empty()) {
    absl::PrintF("no joints\n");
    return absl::OkStatus();
  }
  const absl::StatusOr<std::unique_ptr<JointStream>> stream = client.watch_joints(found->joints);
  if (!stream.ok()) return stream.status();
  const absl::StatusOr<JointFrame> frame = (*stream)->next(kCallTimeout);
  if (!frame.ok()) return frame.status();
  data["tick"] = frame->tick;
  std::vector<std::vector<std::string>> rows = {
      {"id", "name", "type", "parent", "child", "position", "velocity", "unit", "gap", "drive"}};
  auto joint = found->joints.begin();
  for (const JointSample& sample : frame->joints) {
    while (joint->id != sample.id) ++joint;
    rows.push_back(to_row(*joint, sample.state));
    data["joints"].push_back(json_of(*joint, sample.state));
  }
  const std::vector<bool> right = {true, false, false, false, false, true, true, false, true, false};
  absl::PrintF("tick %d\n%s%s", frame->tick, table(rows, right), found->truncated ? "and more\n" : "");
  return absl::OkStatus();
}

void add_joints(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "joints", "List joints by the beginning of their names, with positions and rates.",
                  "tessera joints cart:: --limit 20");
  struct JointsOptions {
    std::string prefix;
    std::uint64_t limit = 0;
  };
  const auto options = std::make_shared<JointsOptions>();
  command.add_option("prefix", options->prefix, "beginning of the names; all joints if not given");
  command.add_option("--limit", options->limit, "how many at most; 0: 1000");
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) {
    return show_joints(client, options->prefix, options->limit, data);
  });
}

void add_drive(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "drive", "Set the drive of a joint.",
                                  "tessera drive cart::left_motor velocity 4\n"
                                  "  tessera drive pendulum::pin_1 servo 0.5 --stiffness 200 --damping 20\n"
                                  "  tessera drive cart::left_motor free");
  struct DriveOptions {
    std::string joint;
    JointDrive drive;
    int axis = 1;
  };
  const auto options = std::make_shared<DriveOptions>();
  command.add_option("joint", options->joint, "its name, or its id")->required();
  add_parsed(command, "mode", options->drive.mode, parse_mode, "velocity, position, effort, servo or free")
      ->required();
  command.add_option("target", options->drive.target, "rad/s or m/s; rad or m; N m or N");
  command.add_option("--axis", options->axis, "2: the second axis of a universal joint")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  const std::string of_servo = "of a servo: ";
  command.add_option("--stiffness", options->drive.stiffness, of_servo + "N m/rad or N/m");
  command.add_option("--damping", options->drive.damping, of_servo + "N m s/rad or N s/m");
  command.add_option("--velocity", options->drive.velocity, of_servo + "that of its target, rad/s or m/s");
  command.add_option("--effort", options->drive.effort, of_servo + "what it applies on top, N m or N");
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) {
    return print_effect(client.set_drive(parse_joint(options->joint), options->drive, options->axis), data);
  });
}

}  // namespace

void add_joint_commands(CLI::App& app, Action& action) {
  add_joints(app, action);
  add_drive(app, action);
}

}  // namespace tessera::cli
