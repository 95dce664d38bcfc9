#include "viewer/model_requests.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "client_sdk/live/sensor_programs.h"
#include "viewer/json.h"
#include "viewer/page_requests.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;

constexpr std::uint64_t kNamesMax = 30;
constexpr std::uint64_t kPartsMax = 500;
constexpr std::size_t kFoundMax = 500;
constexpr std::uint64_t kSearchedMax = 20'000;

json number_or_null(double number) { return std::isfinite(number) ? json(number) : json(); }

bool is_angle(JointType type) { return type != JointType::kPrismatic; }

json axes_with(const FoundJoint& joint, const JointValues* values) {
  json axes = json::array();
  const JointProperties& properties = joint.joint.properties;
  for (std::size_t n = 0; n < axes_of(properties).size(); ++n) {
    const JointAxis& axis = properties.axes[n];
    const JointDrive& drive = joint.joint.drives[n];
    const bool is_led = drive.mode == DriveMode::kPosition || drive.mode == DriveMode::kServo;
    const bool is_known = values != nullptr && n < values->positions.size();
    axes.push_back({{"position", is_known ? number_or_null(values->positions[n]) : json()},
                    {"lower", number_or_null(axis.lower)},
                    {"upper", number_or_null(axis.upper)},
                    {"target", is_led ? json(drive.target) : json()},
                    {"unit", is_angle(properties.type) ? "rad" : "m"}});
  }
  return axes;
}

json numbers_of(const std::vector<NamedNumber>& numbers) {
  json result = json::object();
  for (const NamedNumber& number : numbers) result[number.name] = number.value;
  return result;
}

// From where a ranger looks to what its rays have met, in the frame of its body (m): six numbers each.
json rays_of(const FoundProgram& program) {
  json rays = json::array();
  if (program.kind != "ranger") return rays;
  const RayFan fan = live::fan_of(program);
  const Pose mounting = live::mounting_of(program).value_or(Pose{});
  const double most = live::parameter_of(program, "most");
  const auto first = std::ranges::find(program.values, absl::string_view("range_0"), &NamedNumber::name);
  const auto count = static_cast<std::size_t>(program.values.end() - first);
  for (std::size_t n = 0; n < std::min(count, fan.count()); ++n) {
    const double range = first[static_cast<std::ptrdiff_t>(n)].value;
    if (!(range > 0 && range < most)) continue;
    const Eigen::Vector3d end = mounting * Eigen::Vector3d(range * fan.direction(n));
    for (const Eigen::Vector3d& point : {mounting.position, end}) {
      for (const double coordinate : point) rays.push_back(coordinate);
    }
  }
  return rays;
}

}  // namespace

absl::StatusOr<json> names(Client& client, const json& request) {
  const absl::StatusOr<FoundBodies> found = client.find_bodies(
      {.prefix = request.at("text").get<std::string>(), .limit = kNamesMax}, kRequestTimeout);
  if (!found.ok()) return found.status();
  json all = json::array();
  for (const FoundBody& body : found->bodies) all.push_back({{"id", body.id.value}, {"name", body.name}});
  return json{{"names", std::move(all)}, {"truncated", found->truncated}};
}

absl::StatusOr<json> search(Client& client, const json& request) {
  const std::string text = absl::AsciiStrToLower(request.at("text").get<std::string>());
  const absl::StatusOr<FoundBodies> found = client.find_bodies({.limit = kSearchedMax}, kRequestTimeout);
  if (!found.ok()) return found.status();
  json all = json::array();
  bool truncated = found->truncated;
  for (const FoundBody& body : found->bodies) {
    if (!absl::StrContains(absl::AsciiStrToLower(body.name), text)) continue;
    truncated |= all.size() == kFoundMax;
    if (all.size() == kFoundMax) break;
    all.push_back({{"id", body.id.value}, {"name", body.name}});
  }
  return json{{"names", std::move(all)}, {"truncated", truncated}};
}

absl::StatusOr<json> model(Client& client, const json& request) {
  const std::string prefix = absl::StrCat(request.at("model").get<std::string>(), "::");
  QueryList queries;
  const auto bodies = queries.find_bodies({.prefix = prefix, .limit = kPartsMax});
  const auto joints = queries.find_joints(prefix, kPartsMax);
  const auto states = queries.joint_states({.prefix = prefix});
  const absl::StatusOr<Answers> answers = client.ask(queries, kRequestTimeout);
  if (!answers.ok()) return answers.status();
  const FoundBodies found_bodies = (*answers)[bodies];
  const FoundJoints found_joints = (*answers)[joints];
  const std::vector<JointValues> values = (*answers)[states];
  json told = {{"bodies", json::array()},
               {"joints", json::array()},
               {"truncated", found_bodies.truncated || found_joints.truncated}};
  for (const FoundBody& body : found_bodies.bodies)
    told["bodies"].push_back({{"id", body.id.value}, {"name", body.name}});
  for (const FoundJoint& joint : found_joints.joints) {
    const auto state = std::ranges::find(values, joint.id, &JointValues::id);
    json axes = axes_with(joint, state == values.end() ? nullptr : &*state);
    if (axes.empty()) continue;
    told["joints"].push_back({{"name", joint.joint.name}, {"child", joint.child}, {"axes", std::move(axes)}});
  }
  return told;
}

absl::StatusOr<json> drive(Client& client, const json& request) {
  const absl::StatusOr<std::uint64_t> axis = natural_from(request.at("axis"));
  if (!axis.ok()) return absl::InvalidArgumentError(absl::StrCat("axis: ", axis.status().message()));
  const absl::StatusOr<FoundJoint> joint =
      client.find_joint(request.at("joint").get<std::string>(), kRequestTimeout);
  if (!joint.ok()) return joint.status();
  if (*axis >= axes_of(joint->joint.properties).size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("axis: ", *axis, " must be below ", axes_of(joint->joint.properties).size()));
  }
  JointDrive wanted;
  if (!request.value("free", false)) wanted = {DriveMode::kPosition, request.at("target").get<double>()};
  QueryList queries;
  const auto programs = queries.programs();
  const absl::StatusOr<Answers> answers = client.ask(queries, kRequestTimeout);
  if (!answers.ok()) return answers.status();
  const FoundPrograms found = (*answers)[programs];
  const auto controller = std::ranges::find_if(found.programs, [&](const FoundProgram& program) {
    return program.kind == "pid" && live::parameter_of(program, "of_rate") == 0 &&
           live::parameter_of(program, "joint") == static_cast<double>(joint->id.value);
  });
  const bool is_controlled = controller != found.programs.end() && wanted.mode == DriveMode::kPosition;
  CommandList commands;
  if (is_controlled) {
    commands.tell_program(controller->body, {{"set_point", wanted.target}}, controller->program);
  } else {
    commands.set_drive(joint->id, wanted, static_cast<int>(*axis) + 1);
  }
  const absl::StatusOr<Applied> applied = client.apply(commands, kRequestTimeout);
  if (!applied.ok()) return applied.status();
  return json{{"tick", applied->tick}};
}

absl::StatusOr<json> programs(Client& client, const json& request) {
  const absl::StatusOr<std::uint64_t> id = natural_from(request.at("body"));
  if (!id.ok()) return absl::InvalidArgumentError(absl::StrCat("body: ", id.status().message()));
  QueryList queries;
  const auto place = queries.programs({.ids = {BodyId{*id}}});
  const absl::StatusOr<Answers> answers = client.ask(queries, kRequestTimeout);
  if (!answers.ok()) return answers.status();
  json found = json::array();
  for (const FoundProgram& program : (*answers)[place].programs) {
    found.push_back({{"kind", program.kind},
                     {"name", program.name},
                     {"inputs", numbers_of(program.inputs)},
                     {"values", numbers_of(program.values)},
                     {"fault", program.fault},
                     {"rays", rays_of(program)}});
  }
  return json{{"programs", std::move(found)}};
}

}  // namespace tessera::viewer
