#include "worlds/loader/joint_followers.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "worlds/loader/model_template.h"

namespace tessera {
namespace {

using xml::Element;

// Two axes are the same if the cosine between them is at least this.
constexpr double kSameAxis = 0.999;

absl::StatusOr<MimicByName> mimic_of(const Element& element, std::size_t axis) {
  MimicByName result;
  result.axis = axis;
  const absl::StatusOr<std::string> leader = xml::required_attribute(element, "joint");
  if (!leader.ok()) return leader.status();
  result.leader = *leader;
  const absl::string_view of = element.Attribute("axis") == nullptr ? "axis" : element.Attribute("axis");
  if (of != "axis" && of != "axis2") return xml::invalid(element, "axis '", of, "' must be axis or axis2");
  result.mimic.axis = of == "axis" ? 0 : 1;
  for (const auto& [name, number] :
       {std::pair{"multiplier", &result.mimic.multiplier}, std::pair{"reference", &result.mimic.reference},
        std::pair{"offset", &result.mimic.offset}}) {
    const Element* child = element.FirstChildElement(name);
    if (child == nullptr) continue;
    const absl::StatusOr<double> value = xml::number_of(*child);
    if (!value.ok()) return value.status();
    *number = *value;
  }
  return result;
}

const JointTemplate* find_joint(const ModelTemplate& model, const std::string& name) {
  const auto found = std::ranges::find(model.joints, name, &JointTemplate::name);
  return found == model.joints.end() ? nullptr : &*found;
}

JointId id_of(const ModelTemplate& model, const JointTemplate& joint) {
  return JointId{static_cast<std::uint64_t>(&joint - model.joints.data()) + 1};
}

absl::Status follow(const absl::flat_hash_set<std::string>& names, const MimicByName& by_name,
                    JointTemplate& follower, ModelTemplate& model) {
  if (!names.contains(by_name.leader)) {
    return absl::InvalidArgumentError(
        absl::StrCat("joint '", follower.name, "': <mimic>: there is no joint '", by_name.leader, "'"));
  }
  if (by_name.axis >= axes_of(follower.properties).size()) {
    model.notices.count("<mimic> of an axis without a coordinate, skipped");
    return absl::OkStatus();
  }
  const JointTemplate* leader = find_joint(model, by_name.leader);
  if (leader == nullptr || by_name.mimic.axis >= axes_of(leader->properties).size()) {
    model.notices.count("joint whose <mimic> follows a joint that is left out or cannot move: moves freely");
    return absl::OkStatus();
  }
  AxisMimic& mimic = follower.properties.axes[by_name.axis].mimic = by_name.mimic;
  mimic.leader = id_of(model, *leader);
  if (leader->is_exchanged && leader->properties.type == JointType::kUniversal) mimic.axis = 1 - mimic.axis;
  return absl::OkStatus();
}

// A joint about which a link turns on another one, and the sign of its angle.
struct Hinge {
  JointTemplate* joint = nullptr;
  double sign = 0;
};

Hinge find_hinge(ModelTemplate& model, std::optional<std::size_t> reference, std::optional<std::size_t> link,
                 const Eigen::Vector3d& direction) {
  for (JointTemplate& joint : model.joints) {
    if (joint.properties.type != JointType::kRevolute) continue;
    const bool is_forward = joint.parent == reference && link == joint.child;
    const bool is_backward = joint.parent == link && reference == joint.child;
    if (!is_forward && !is_backward) continue;
    const Pose frame = model.links[joint.child].pose * joint.properties.in_child;
    const double cosine = direction.dot(frame.orientation * Eigen::Vector3d::UnitX());
    if (std::abs(cosine) < kSameAxis) continue;
    return {&joint, std::copysign(1, is_forward ? cosine : -cosine)};
  }
  return {};
}

void connect(const Gearbox& gearbox, ModelTemplate& model) {
  const Hinge first = find_hinge(model, gearbox.reference, gearbox.parent, gearbox.parent_axis);
  const Hinge second = find_hinge(model, gearbox.reference, gearbox.child, gearbox.child_axis);
  if (first.joint == nullptr || second.joint == nullptr || first.joint == second.joint) {
    model.notices.count_joint_left_out("gearbox without hinges of both links on its reference body");
    return;
  }
  AxisMimic& mimic = second.joint->properties.axes[0].mimic;
  if (mimic.is_set()) {
    model.notices.count_joint_left_out("gearbox whose child follows another joint already");
    return;
  }
  mimic.leader = id_of(model, *first.joint);
  mimic.multiplier = -gearbox.ratio * first.sign * second.sign;
  model.notices.count_joint("gearbox");
}

}  // namespace

absl::Status keep_mimics(Element& joint) {
  for (const auto& [name, place] : {std::pair{"axis", std::size_t{0}}, std::pair{"axis2", std::size_t{1}}}) {
    Element* axis = joint.FirstChildElement(name);
    Element* element = axis == nullptr ? nullptr : axis->FirstChildElement("mimic");
    if (element == nullptr) continue;
    if (const Element* second = element->NextSiblingElement("mimic"))
      return xml::invalid(*second, "the axis has a <mimic> already");
    const absl::StatusOr<MimicByName> kept = mimic_of(*element, place);
    if (!kept.ok()) return kept.status();
    axis->DeleteChild(element);
    const std::string text =
        absl::StrFormat("%d %d %.17g %.17g %.17g %s", kept->axis, kept->mimic.axis, kept->mimic.multiplier,
                        kept->mimic.reference, kept->mimic.offset, kept->leader);
    joint.InsertNewChildElement(kKeptMimic.data())->SetText(text.c_str());
  }
  return absl::OkStatus();
}

std::optional<MimicByName> mimic_in(const std::string& text) {
  const std::vector<std::string> words = absl::StrSplit(text, absl::MaxSplits(' ', 5));
  MimicByName result;
  int axis = 0;
  if (words.size() != 6 || !absl::SimpleAtoi(words[0], &result.axis) || !absl::SimpleAtoi(words[1], &axis) ||
      !absl::SimpleAtod(words[2], &result.mimic.multiplier) ||
      !absl::SimpleAtod(words[3], &result.mimic.reference) ||
      !absl::SimpleAtod(words[4], &result.mimic.offset)) {
    return std::nullopt;
  }
  result.mimic.axis = axis == 0 ? 0 : 1;
  result.leader = words[5];
  return result;
}

absl::Status connect_followers(const absl::flat_hash_set<std::string>& names,
                               const std::vector<Gearbox>& gearboxes, ModelTemplate& model) {
  for (JointTemplate& follower : model.joints) {
    for (const MimicByName& mimic : follower.mimics) {
      if (absl::Status status = follow(names, mimic, follower, model); !status.ok()) return status;
    }
  }
  for (const Gearbox& gearbox : gearboxes) connect(gearbox, model);
  return absl::OkStatus();
}

}  // namespace tessera
