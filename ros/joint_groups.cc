#include "ros/joint_groups.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <set>

#include "daemon/log.h"
#include "ros/yaml_file.h"

namespace tessera::ros {
namespace {

constexpr char kManager[] = "controller_manager";
constexpr char kParameters[] = "ros__parameters";
constexpr char kForward[] = "forward_command_controller/ForwardCommandController";
constexpr int kDepthMax = 16;  // of namespaces

struct ControllerType {
  absl::string_view name;
  DriveMode mode = DriveMode::kPosition;
};
constexpr std::array kOfOneKind = {
    ControllerType{"position_controllers/JointGroupPositionController", DriveMode::kPosition},
    ControllerType{"velocity_controllers/JointGroupVelocityController", DriveMode::kVelocity},
    ControllerType{"effort_controllers/JointGroupEffortController", DriveMode::kEffort},
};
constexpr std::array kInterfaces = {
    ControllerType{"position", DriveMode::kPosition},
    ControllerType{"velocity", DriveMode::kVelocity},
    ControllerType{"effort", DriveMode::kEffort},
};

template <std::size_t kCount>
std::optional<DriveMode> mode_in(const std::array<ControllerType, kCount>& table, absl::string_view name) {
  const auto found = std::ranges::find(table, name, &ControllerType::name);
  return found == table.end() ? std::nullopt : std::optional(found->mode);
}

// The parameters of nodes by their full names: "/left/controller_manager". Stars, which stand for any
// namespace, are left out.
using Nodes = std::map<std::string, YAML::Node>;

void collect(const YAML::Node& within, const std::string& above, int depth, Nodes& nodes) {
  if (!within.IsMap() || depth > kDepthMax) return;
  for (const auto& entry : within) {
    const std::optional<std::string> key = text_of(entry.first);
    if (!key) continue;
    if (*key == kParameters) {
      nodes.insert_or_assign(above, entry.second);
      continue;
    }
    std::string name = above;
    for (const absl::string_view word : absl::StrSplit(*key, '/', absl::SkipEmpty())) {
      if (word.find('*') == absl::string_view::npos) absl::StrAppend(&name, "/", word);
    }
    collect(entry.second, name, depth + 1, nodes);
  }
}

bool is_name(absl::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_';
  });
}

absl::StatusOr<std::vector<std::string>> joints_of(const std::string& file, const YAML::Node& parameters,
                                                   const std::string& controller) {
  const YAML::Node joints = parameters["joints"];
  if (!joints.IsDefined() || !joints.IsSequence() || joints.size() == 0 || joints.size() > kJointsOfAGroupMax)
    return fault_at(file, joints.IsDefined() ? joints : parameters, "controller ", controller,
                    ": joints must be a list of 1 to ", kJointsOfAGroupMax, " names");
  std::vector<std::string> names;
  for (const YAML::Node& joint : joints) {
    const std::optional<std::string> name = text_of(joint);
    if (!name || name->empty())
      return fault_at(file, joint, "controller ", controller, ": a joint must be a name");
    if (std::ranges::find(names, *name) != names.end())
      return fault_at(file, joint, "controller ", controller, ": the joint ", *name, " must be there once");
    names.push_back(*name);
  }
  return names;
}

absl::StatusOr<JointGroup> group_of(const std::string& file, const Nodes& nodes, const std::string& node,
                                    const YAML::Node& declared, std::optional<DriveMode> mode) {
  const auto found = nodes.find(node);
  if (found == nodes.end())
    return fault_at(file, declared, "controller ", node, ": it must have ", kParameters, " with its joints");
  const YAML::Node& parameters = found->second;
  if (!parameters.IsMap())
    return fault_at(file, parameters, "controller ", node, ": its ", kParameters, " must be a map");
  if (!mode) {
    const YAML::Node interface = parameters["interface_name"];
    const std::optional<std::string> name = interface.IsDefined() ? text_of(interface) : std::nullopt;
    mode = name ? mode_in(kInterfaces, *name) : std::nullopt;
    if (!mode)
      return fault_at(file, interface.IsDefined() ? interface : parameters, "controller ", node,
                      ": interface_name must be position, velocity or effort");
  }
  absl::StatusOr<std::vector<std::string>> joints = joints_of(file, parameters, node);
  if (!joints.ok()) return joints.status();
  return JointGroup{absl::StrCat(node, "/commands"), *mode, *std::move(joints)};
}

}  // namespace

absl::StatusOr<std::vector<JointGroup>> read_controllers(const std::string& file) {
  const absl::StatusOr<YAML::Node> root = read_yaml(file);
  if (!root.ok()) return root.status();
  Nodes nodes;
  collect(*root, "", 0, nodes);
  std::vector<JointGroup> groups;
  bool has_manager = false;
  for (const auto& [manager, parameters] : nodes) {
    if (manager.substr(manager.rfind('/') + 1) != kManager || !parameters.IsMap()) continue;
    has_manager = true;
    const std::string above = manager.substr(0, manager.rfind('/') + 1);
    for (const auto& entry : parameters) {
      const std::optional<std::string> name = text_of(entry.first);
      const YAML::Node type = entry.second.IsMap() ? entry.second["type"] : YAML::Node();
      const std::optional<std::string> kind = text_of(type);
      if (!name || !kind) continue;  // a parameter of the manager
      if (!is_name(*name))
        return fault_at(file, entry.first, "the name of a controller, '", *name,
                        "', must have letters, digits and '_'");
      const std::optional<DriveMode> mode = mode_in(kOfOneKind, *kind);
      if (!mode && *kind != kForward) {
        log_info(absl::StrCat(file, ": controller ", *name, " (", *kind,
                              ") is not one of those that are run here"));
        continue;
      }
      absl::StatusOr<JointGroup> group = group_of(file, nodes, absl::StrCat(above, *name), type, mode);
      if (!group.ok()) return group.status();
      groups.push_back(*std::move(group));
      if (groups.size() > kJointGroupsMax)
        return fault_at(file, type, "there must be at most ", kJointGroupsMax, " controllers");
    }
  }
  if (!has_manager) return fault_at(file, *root, "there must be a ", kManager, " with ", kParameters);
  return groups;
}

}  // namespace tessera::ros
