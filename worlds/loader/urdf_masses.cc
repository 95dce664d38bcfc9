#include "worlds/loader/urdf_masses.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/limits.h"
#include "worlds/loader/massless_links.h"
#include "worlds/loader/repairs.h"

namespace tessera {
namespace {

using xml::Element;

// Libsdformat takes masses up to 1e-6 kg for none.
constexpr double kUrdfMassMin = 2 * kMassMin;

struct RobotJoint {
  std::size_t parent = 0;
  std::size_t child = 0;
  bool is_fixed = false;
};

// The links of a robot and what joins them.
class Robot {
 public:
  Robot(Element& robot, Notices& notices) : robot_(robot), notices_(notices) {}

  absl::Status repair();

 private:
  absl::Status read_links();
  absl::StatusOr<LinkMass> read_mass(Element& link);
  void read_joints();
  std::size_t top_of(std::size_t link) const;
  void complete_masses();
  void fix_to_world(const std::string& link);

  Element& robot_;
  Notices& notices_;
  std::vector<Element*> links_;
  std::vector<LinkMass> masses_;
  absl::flat_hash_set<const Element*>
      weightless_;  // with a mass of 0, which says so on purpose in Bullet's files
  absl::flat_hash_map<std::string, std::size_t> places_;
  std::vector<RobotJoint> joints_;
  std::vector<std::optional<std::size_t>> incoming_;  // the joint whose child a link is
};

void set_inertial(Element& link, const LinkMass& of) {
  Element& inertial = *link.InsertNewChildElement("inertial");
  inertial.InsertNewChildElement("mass")->SetAttribute("value", absl::StrCat(of.mass).c_str());
  Element& inertia = *inertial.InsertNewChildElement("inertia");
  for (const char* moment : {"ixx", "iyy", "izz"})
    inertia.SetAttribute(moment, absl::StrCat(of.moment).c_str());
  for (const char* product : {"ixy", "ixz", "iyz"}) inertia.SetAttribute(product, "0");
}

absl::StatusOr<LinkMass> Robot::read_mass(Element& link) {
  Element* inertial = link.FirstChildElement("inertial");
  if (inertial == nullptr) return LinkMass{};
  Element* mass = inertial->FirstChildElement("mass");
  LinkMass result;
  if (mass != nullptr) {
    const absl::StatusOr<double> value = xml::number_attribute(*mass, "value");
    if (!value.ok()) return value.status();
    if (*value < 0) return xml::invalid(*mass, "mass = ", *value, " kg must be at least 0 kg");
    result.mass = *value;
  }
  if (result.mass == 0) {
    if (mass != nullptr) weightless_.insert(&link);
    link.DeleteChild(inertial);
    return result;
  }
  if (result.mass < kUrdfMassMin) {
    notices_.count_repair(absl::StrCat("mass below ", kUrdfMassMin, " kg, raised to it"),
                          xml::place_of(*mass));
    result.mass = kUrdfMassMin;
    mass->SetAttribute("value", result.mass);
  }
  Element* inertia = inertial->FirstChildElement("inertia");
  if (inertia == nullptr) inertia = inertial->InsertNewChildElement("inertia");
  bool complete = true;
  for (const char* name : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
    if (inertia->Attribute(name) == nullptr) {
      complete = false;
      inertia->SetAttribute(name, "0");
    }
    const absl::StatusOr<double> number = xml::number_attribute(*inertia, name);
    if (!number.ok()) return number.status();
    if (name[1] == name[2]) result.moment += *number / 3;
  }
  if (!complete) notices_.count_repair("inertia that is not complete, taken as 0", xml::place_of(*inertial));
  return result;
}

absl::Status Robot::read_links() {
  for (Element* link = robot_.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const absl::StatusOr<std::string> name = xml::required_attribute(*link, "name");
    if (!name.ok()) return name.status();
    absl::StatusOr<LinkMass> mass = read_mass(*link);
    if (!mass.ok()) return mass.status();
    places_.emplace(*name, links_.size());
    links_.push_back(link);
    masses_.push_back(*mass);
  }
  incoming_.resize(links_.size());
  return absl::OkStatus();
}

void Robot::read_joints() {
  const auto link_of = [this](const Element& joint, const char* side) {
    const Element* element = joint.FirstChildElement(side);
    const char* name = element == nullptr ? nullptr : element->Attribute("link");
    return name == nullptr ? places_.end() : places_.find(name);
  };
  for (const Element* joint = robot_.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const auto parent = link_of(*joint, "parent");
    const auto child = link_of(*joint, "child");
    if (parent == places_.end() || child == places_.end()) continue;  // libsdformat says what is wrong
    incoming_[child->second] = joints_.size();
    joints_.push_back({parent->second, child->second, joint->Attribute("type", "fixed") != nullptr});
  }
}

bool is_world(const Element& link) { return link.Attribute("name", "world") != nullptr; }

// The link that libsdformat joins `link` to, over fixed joints; the world is no link.
std::size_t Robot::top_of(std::size_t link) const {
  for (std::size_t steps = 0; steps < links_.size() && incoming_[link];
       ++steps) {  // as long as there is no circle
    const RobotJoint& joint = joints_[*incoming_[link]];
    if (!joint.is_fixed || is_world(*links_[joint.parent])) break;
    link = joint.parent;
  }
  return link;
}

// Fixes a link to the world with a URDF joint.
void Robot::fix_to_world(const std::string& link) {
  if (!places_.contains("world")) robot_.InsertNewChildElement("link")->SetAttribute("name", "world");
  Element* joint = robot_.InsertNewChildElement("joint");
  joint->SetAttribute("name", absl::StrCat(link, "_fixed_to_world").c_str());
  joint->SetAttribute("type", "fixed");
  joint->InsertNewChildElement("parent")->SetAttribute("link", "world");
  joint->InsertNewChildElement("child")->SetAttribute("link", link.c_str());
}

void Robot::complete_masses() {
  std::vector<LinkMass> sums(links_.size());  // of what is joined, at its top
  std::vector<std::size_t> tops(links_.size());
  for (std::size_t n = 0; n < links_.size(); ++n) {
    tops[n] = top_of(n);
    sums[tops[n]].mass += masses_[n].mass;
    sums[tops[n]].moment += masses_[n].moment;
    if (tops[n] != n) notices_.count("link on a fixed joint, part of its parent's body");
  }
  std::vector<std::pair<std::size_t, std::size_t>> joints;
  for (const RobotJoint& joint : joints_) joints.emplace_back(tops[joint.parent], tops[joint.child]);
  std::vector<LinkMass> completed = sums;
  give_least_masses(completed, joints);
  for (std::size_t n = 0; n < links_.size(); ++n) {
    if (tops[n] != n || sums[n].mass > 0 || is_world(*links_[n])) continue;
    if (!incoming_[n]) {
      if (weightless_.contains(links_[n])) {
        notices_.count("link of mass 0 that nothing holds, fixed to the world");
      } else {
        notices_.count_repair("link without mass that nothing holds, fixed to the world",
                              xml::place_of(*links_[n]));
      }
      fix_to_world(links_[n]->Attribute("name"));
    } else if (!joints_[*incoming_[n]].is_fixed) {
      notices_.count_repair(kMasslessLink, xml::place_of(*links_[n]));
    }
    set_inertial(*links_[n], completed[n]);
  }
}

absl::Status Robot::repair() {
  if (absl::Status status = read_links(); !status.ok()) return status;
  read_joints();
  complete_masses();
  return absl::OkStatus();
}

}  // namespace

absl::Status repair_urdf_masses(Element& robot, Notices& notices) { return Robot(robot, notices).repair(); }

}  // namespace tessera
