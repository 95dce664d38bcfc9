#include "worlds/loader/repairs.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <string>
#include <vector>

#include "lpss/model/limits.h"

namespace tessera {

using xml::Element;

namespace {

constexpr absl::string_view kReserved = "world";

// What follows a joint of that name, in a <joint> of SDF or URDF.
void rename_leaders(Element& parent, const absl::flat_hash_map<std::string, std::string>& names) {
  for (Element* child = parent.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    if (xml::is(*child, "axis") || xml::is(*child, "axis2")) rename_leaders(*child, names);
    const char* leader = xml::is(*child, "mimic") ? child->Attribute("joint") : nullptr;
    if (leader == nullptr) continue;
    if (const auto found = names.find(leader); found != names.end())
      child->SetAttribute("joint", found->second.c_str());
  }
}

// Of a link, in a model and in what it has, nested models excepted.
void rename_link_references(Element& element, const std::string& name) {
  for (const char* attribute : {"relative_to", "attached_to", "expressed_in"}) {
    const char* const value = element.Attribute(attribute);
    if (value != nullptr && value == kReserved) element.SetAttribute(attribute, name.c_str());
  }
  for (const char* tag : {"parent", "child", "gearbox_reference_body"}) {
    if (xml::is(element, tag) && xml::text_of(element) == kReserved) element.SetText(name.c_str());
  }
  for (Element* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    if (!xml::is(*child, "model")) rename_link_references(*child, name);
  }
}

}  // namespace

void settle_world_link(Element& model, Notices& notices) {
  absl::flat_hash_set<std::string> names;
  Element* reserved = nullptr;
  for (Element* child = model.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    const char* const name = child->Attribute("name");
    if (name == nullptr) continue;
    names.insert(name);
    if (xml::is(*child, "link") && name == kReserved) reserved = child;
  }
  if (reserved == nullptr) return;
  if (reserved->FirstChildElement("inertial") == nullptr &&
      reserved->FirstChildElement("collision") == nullptr) {
    notices.count_repair("link named world with no mass and no shape: the world itself",
                         xml::place_of(*reserved));
    model.DeleteChild(reserved);
    return;
  }
  notices.count_repair("link named world, which SDF reserves: it got the suffix _link",
                       xml::place_of(*reserved));
  std::string other = absl::StrCat(kReserved, "_link");
  while (names.contains(other)) absl::StrAppend(&other, "_link");
  reserved->SetAttribute("name", other.c_str());
  rename_link_references(model, other);
}

void rename_joints(Element& model, Notices& notices) {
  absl::flat_hash_set<std::string> others;
  absl::flat_hash_set<std::string> joints;
  for (const Element* child = model.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    const char* name = child->Attribute("name");
    if (name == nullptr) continue;
    if (xml::is(*child, "joint")) joints.insert(name);
    if (xml::is(*child, "link") || xml::is(*child, "frame") || xml::is(*child, "model")) others.insert(name);
  }
  absl::flat_hash_map<std::string, std::string> renamed;
  for (Element* joint = model.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* name = joint->Attribute("name");
    const bool is_reserved = name != nullptr && name == kReserved;
    if (name == nullptr || (!is_reserved && !others.contains(name))) continue;
    std::string other = absl::StrCat(name, "_joint");
    while (others.contains(other) || joints.contains(other)) absl::StrAppend(&other, "_joint");
    notices.count_repair(is_reserved ? "joint named world, which SDF reserves: it got the suffix _joint"
                                     : "joint with the name of a link or frame, which got the suffix _joint",
                         xml::place_of(*joint));
    joints.insert(other);
    renamed[name] = other;
    joint->SetAttribute("name", other.c_str());
  }
  for (Element* joint = model.FirstChildElement("joint"); joint != nullptr && !renamed.empty();
       joint = joint->NextSiblingElement("joint")) {
    rename_leaders(*joint, renamed);
  }
}

void rename_collisions(Element& link, Notices& notices) {
  absl::flat_hash_set<std::string> names;
  for (Element* collision = link.FirstChildElement("collision"); collision != nullptr;
       collision = collision->NextSiblingElement("collision")) {
    const char* const name = collision->Attribute("name");
    if (name == nullptr || names.insert(name).second) continue;
    notices.count_repair("collision with the name of another one of its link, which got a suffix",
                         xml::place_of(*collision));
    std::string other;
    for (int n = 2; other.empty() || !names.insert(other).second; ++n) other = absl::StrCat(name, "_", n);
    collision->SetAttribute("name", other.c_str());
  }
}

void repair_friction(Element& engine, Notices& notices) {
  constexpr double kInfinite = 1e6;
  for (const char* name : {"mu", "mu2", "friction", "friction2"}) {
    Element* const coefficient = engine.FirstChildElement(name);
    double value = 0;
    if (coefficient == nullptr || coefficient->QueryDoubleText(&value) != tinyxml2::XML_SUCCESS) continue;
    if (!(value < 0)) continue;
    notices.count_repair(absl::StrCat("friction below 0, taken as infinite: ", kInfinite),
                         xml::place_of(*coefficient));
    coefficient->SetText(kInfinite);
  }
}

void repair_sizes(Element& shape, Notices& notices) {
  if (xml::is(shape, "plane")) return;  // its size is for display
  for (const char* name : {"size", "radius", "length", "radii"}) {
    Element* const size = shape.FirstChildElement(name);
    if (size == nullptr) continue;
    absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(*size, xml::text_of(*size));
    if (!numbers.ok()) continue;
    const auto is_tiny = [](double number) { return number > 0 && number < kExtentMin; };
    if (std::ranges::none_of(*numbers, is_tiny)) continue;
    for (double& number : *numbers) number = is_tiny(number) ? kExtentMin : number;
    notices.count_repair(absl::StrCat("size below ", kExtentMin, " m, raised to it"), xml::place_of(*size));
    size->SetText(absl::StrJoin(*numbers, " ").c_str());
  }
}

void rename_root(Element& root, Notices& notices) {
  if (!xml::is(root, "gazebo") || root.Attribute("version") == nullptr) return;
  notices.count("<gazebo> as the root, read as <sdf>");
  root.SetName("sdf");
}

}  // namespace tessera
