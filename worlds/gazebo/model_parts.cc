#include "worlds/gazebo/model_parts.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include "worlds/gazebo/numbers.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

// Frames that are attached to frames: more than anybody writes.
constexpr int kFramesMax = 64;

Element* child_named(Element& parent, const char* tag, absl::string_view name) {
  for (Element* child = parent.FirstChildElement(tag); child != nullptr;
       child = child->NextSiblingElement(tag)) {
    const char* const own = child->Attribute("name");
    if (own != nullptr && name == own) return child;
  }
  return nullptr;
}

Element* find_in(Element& model, const char* tag, absl::string_view name) {
  if (Element* const found = child_named(model, tag, name)) return found;
  const std::size_t colons = name.find("::");
  if (colons == absl::string_view::npos) return nullptr;
  Element* const inner = child_named(model, "model", name.substr(0, colons));
  return inner == nullptr ? nullptr : find_in(*inner, tag, name.substr(colons + 2));
}

// Nothing where it is relative to something else than `frame`.
std::optional<Pose> pose_in(const Element& element, const std::string& frame) {
  const Element* const pose = element.FirstChildElement("pose");
  if (pose == nullptr) return Pose{};
  absl::StatusOr<xml::RelativePose> given = xml::pose_of(*pose);
  if (!given.ok() || (!given->relative_to.empty() && given->relative_to != frame)) return std::nullopt;
  return given->pose;
}

}  // namespace

Element* ModelParts::find(const char* tag, const std::string& name) const {
  if (Element* const found = find_in(model_, tag, name)) return found;
  const char* const own = model_.Attribute("name");
  absl::string_view rest = name;
  if (own == nullptr || !absl::ConsumePrefix(&rest, absl::StrCat(own, "::"))) return nullptr;
  return find_in(model_, tag, rest);
}

// One with the name of a link has been given another one (rename_joints()).
Element* ModelParts::joint(const std::string& name) const {
  Element* const found = find("joint", name);
  return found != nullptr ? found : find("joint", absl::StrCat(name, "_joint"));
}

std::optional<ModelParts::Place> ModelParts::place(const std::string& name) const {
  Place place;
  std::string at = name;
  for (int steps = 0; steps < kFramesMax; ++steps) {
    place.link = link(at);
    if (place.link != nullptr) return place;
    const Element* const frame = find("frame", at);
    const char* const attached = frame == nullptr ? nullptr : frame->Attribute("attached_to");
    if (attached == nullptr) return std::nullopt;
    const std::optional<Pose> pose = pose_in(*frame, attached);
    if (!pose) return std::nullopt;
    place.pose = *pose * place.pose;
    at = attached;
  }
  return std::nullopt;
}

double ModelParts::mass(const Element* but) const {
  double sum = 0;
  for (const Element* link = first_link(); link != nullptr; link = link->NextSiblingElement("link")) {
    Numbers numbers;
    const double mass = numbers.read(tessera::gazebo::find(link, {"inertial", "mass"}), 0);
    if (link != but && mass > 0) sum += mass;
  }
  return sum;
}

std::string ModelParts::name_of(const Element& part) const {
  std::string name;
  for (const Element* at = &part; at != nullptr && at != &model_;
       at = at->Parent() == nullptr ? nullptr : at->Parent()->ToElement()) {
    const char* const own = at->Attribute("name");
    name = absl::StrCat(own == nullptr ? "" : own, name.empty() ? "" : "::", name);
  }
  return name;
}

Element* ModelParts::side(const Element& joint, const char* side) const {
  const Element* const name = joint.FirstChildElement(side);
  // In URDF, and in SDF before 1.5, as an attribute.
  const char* const attribute = name == nullptr ? nullptr : name->Attribute("link");
  const std::string text = attribute != nullptr ? attribute : xml::child_text(joint, side);
  // Names are those of the model in which the joint is.
  auto* const around = const_cast<Element&>(joint).Parent()->ToElement();
  const std::optional<Place> found = ModelParts(*around).place(text);
  return found ? found->link : nullptr;
}

bool ModelParts::is_static() const {
  const xml::Element* const fixed = model_.FirstChildElement("static");
  return fixed != nullptr && xml::bool_of(*fixed).value_or(false);
}

void ModelParts::make_kinematic() const {
  if (xml::Element* const fixed = model_.FirstChildElement("static")) fixed->SetText("false");
  for (xml::Element* link = first_link(); link != nullptr; link = link->NextSiblingElement("link")) {
    if (link->FirstChildElement("kinematic") == nullptr) link->InsertNewChildElement("kinematic");
    link->FirstChildElement("kinematic")->SetText("true");
  }
}

}  // namespace tessera::gazebo
