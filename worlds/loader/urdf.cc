#include "worlds/loader/urdf.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <cstring>
#include <string>

#include "worlds/loader/sdf_parser.h"

namespace tessera {
namespace {

using xml::Element;

void skip_children(Element& parent, const char* name, Notices& notices) {
  while (Element* child = parent.FirstChildElement(name)) {
    notices.count(absl::StrCat("<", name, "> skipped"));
    parent.DeleteChild(child);
  }
}

std::string link_of(const Element& joint, const char* side) {
  const Element* element = joint.FirstChildElement(side);
  const char* name = element == nullptr ? nullptr : element->Attribute("link");
  return name == nullptr ? "" : name;
}

// Fixes a link to the world with a URDF joint.
void fix_to_world(Element& robot, const std::string& link) {
  bool has_world = false;
  for (const Element* other = robot.FirstChildElement("link"); other != nullptr;
       other = other->NextSiblingElement("link")) {
    has_world = has_world || other->Attribute("name", "world") != nullptr;
  }
  if (!has_world) robot.InsertNewChildElement("link")->SetAttribute("name", "world");
  Element* joint = robot.InsertNewChildElement("joint");
  joint->SetAttribute("name", absl::StrCat(link, "_fixed_to_world").c_str());
  joint->SetAttribute("type", "fixed");
  joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
  joint->InsertNewChildElement("child")->SetAttribute("link", link.c_str());
}

// libsdformat drops links without mass, and all their children.
absl::Status treat_massless_links(Element& robot, const absl::flat_hash_set<std::string>& children) {
  for (Element* link = robot.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    Element* inertial = link->FirstChildElement("inertial");
    Element* mass = inertial == nullptr ? nullptr : inertial->FirstChildElement("mass");
    if (mass == nullptr) continue;
    const absl::StatusOr<double> value = xml::number_attribute(*mass, "value");
    if (!value.ok()) return value.status();
    if (*value > 0) continue;
    const char* name = link->Attribute("name");
    if (*value < 0 || name == nullptr || children.contains(name)) {
      return xml::invalid(*mass, "mass = ", *value, " kg must be above 0");
    }
    inertial->DeleteChild(mass);
    if (Element* tensor = inertial->FirstChildElement("inertia")) inertial->DeleteChild(tensor);
    inertial->InsertNewChildElement("mass")->SetAttribute("value", 1);
    Element* tensor = inertial->InsertNewChildElement("inertia");
    for (const char* moment : {"ixx", "iyy", "izz"}) tensor->SetAttribute(moment, 1);
    for (const char* product : {"ixy", "ixz", "iyz"}) tensor->SetAttribute(product, 0);
    fix_to_world(robot, name);
  }
  return absl::OkStatus();
}

// urdfdom drops capsules: they are passed as cylinders with a marked collision name.
constexpr char kCapsule[] = "tessera_capsule";

void hide_capsules(Element& robot) {
  int number = 0;
  for (Element* link = robot.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    for (Element* collision = link->FirstChildElement("collision"); collision != nullptr;
         collision = collision->NextSiblingElement("collision")) {
      Element* geometry = collision->FirstChildElement("geometry");
      Element* capsule = geometry == nullptr ? nullptr : geometry->FirstChildElement("capsule");
      if (capsule == nullptr) continue;
      capsule->SetName("cylinder");
      collision->SetAttribute("name", absl::StrCat(kCapsule, number++).c_str());
    }
  }
}

void restore_capsules(Element& model) {
  for (Element* link = model.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    for (Element* collision = link->FirstChildElement("collision"); collision != nullptr;
         collision = collision->NextSiblingElement("collision")) {
      const char* name = collision->Attribute("name");
      if (name == nullptr || std::strstr(name, kCapsule) == nullptr) continue;
      Element* geometry = collision->FirstChildElement("geometry");
      if (Element* cylinder = geometry->FirstChildElement("cylinder")) cylinder->SetName("capsule");
    }
  }
}

// Spherical joints become ball joints. Children of planar or floating joints are free, and keep their poses.
void restore_joints(Element& model, const absl::flat_hash_map<std::string, std::string>& types) {
  for (Element* joint = model.FirstChildElement("joint"); joint != nullptr;) {
    Element& element = *joint;
    joint = joint->NextSiblingElement("joint");
    const char* name = element.Attribute("name");
    const auto found = types.find(name == nullptr ? "" : name);
    if (found == types.end()) continue;
    if (found->second == "spherical") {
      element.SetAttribute("type", "ball");
      if (Element* axis = element.FirstChildElement("axis")) element.DeleteChild(axis);
      continue;
    }
    element.SetName("frame");
    element.DeleteAttribute("type");
    for (const char* child : {"parent", "child", "axis"}) {
      if (Element* old = element.FirstChildElement(child)) element.DeleteChild(old);
    }
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<xml::File>> urdf_to_sdf(xml::File& file, Notices& notices) {
  Element& robot = file.root();
  absl::flat_hash_set<std::string> children;
  absl::flat_hash_map<std::string, std::string> unknown_joints;  // to libsdformat: names and types
  for (Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    children.insert(link_of(*joint, "child"));
    skip_children(*joint, "mimic", notices);
    const char* type = joint->Attribute("type");
    const std::string type_name = type == nullptr ? "" : type;
    if (type_name != "spherical" && type_name != "planar" && type_name != "floating") continue;
    const absl::StatusOr<std::string> name = xml::required_attribute(*joint, "name");
    if (!name.ok()) return name.status();
    if (type_name != "spherical") notices.count_joint_left_out(type_name);
    unknown_joints[*name] = type_name;
    joint->SetAttribute("type", "continuous");
  }
  if (absl::Status status = treat_massless_links(robot, children); !status.ok()) return status;
  for (Element* link = robot.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    skip_children(*link, "visual", notices);
    skip_children(*link, "contact", notices);
  }
  hide_capsules(robot);
  skip_children(robot, "transmission", notices);
  skip_children(robot, "gazebo", notices);

  const absl::StatusOr<std::string> converted = to_latest_sdf(xml::print(robot));
  if (!converted.ok()) return xml::invalid(robot, converted.status().message());
  absl::StatusOr<std::unique_ptr<xml::File>> result =
      xml::File::parse(*converted, file.name(), file.directory());
  if (!result.ok()) return result.status();
  Element* model = (*result)->root().FirstChildElement("model");
  if (model == nullptr || model->FirstChildElement("link") == nullptr) {
    return xml::invalid(robot, "no link has an <inertial>: there is nothing to simulate");
  }
  restore_joints(*model, unknown_joints);
  restore_capsules(*model);
  return result;
}

}  // namespace tessera
