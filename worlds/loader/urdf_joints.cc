#include "worlds/loader/urdf_joints.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"

namespace tessera {
namespace {

using xml::Element;

constexpr char kWorld[] = "world";

// The link that <parent> or <child> of a joint names; empty if it names none.
std::string end_of(const Element& joint, const char* end) {
  const Element* const element = joint.FirstChildElement(end);
  const char* const link = element == nullptr ? nullptr : element->Attribute("link");
  return link == nullptr ? "" : link;
}

bool is_fixed(const Element& joint) { return joint.Attribute("type", "fixed") != nullptr; }

absl::StatusOr<Pose> origin_of(const Element& joint) {
  const Element* const origin = joint.FirstChildElement("origin");
  Pose pose;
  if (origin == nullptr) return pose;
  Eigen::Vector3d angles = Eigen::Vector3d::Zero();
  for (const auto& [attribute, vector] : {std::pair{"xyz", &pose.position}, std::pair{"rpy", &angles}}) {
    const char* const text = origin->Attribute(attribute);
    if (text == nullptr) continue;
    const absl::StatusOr<Eigen::Vector3d> numbers = xml::vector_in(*origin, text, attribute);
    if (!numbers.ok()) return numbers.status();
    *vector = *numbers;
  }
  pose.orientation =
      (rotation_by({0, 0, angles.z()}) * rotation_by({0, angles.y(), 0}) * rotation_by({angles.x(), 0, 0}))
          .normalized();
  return pose;
}

void set_origin(Element& joint, const Pose& pose) {
  Element* origin = joint.FirstChildElement("origin");
  if (origin == nullptr) origin = joint.InsertNewChildElement("origin");
  const Eigen::Vector3d angles = xml::angles_of(pose.orientation);
  for (const auto& [attribute, v] : {std::pair{"xyz", pose.position}, std::pair{"rpy", angles}})
    origin->SetAttribute(attribute, absl::StrFormat("%.17g %.17g %.17g", v.x(), v.y(), v.z()).c_str());
}

// The links of a robot along its fixed joints.
class FixedLinks {
 public:
  explicit FixedLinks(Element& robot) {
    for (Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
         joint = joint->NextSiblingElement("joint")) {
      const std::string parent = end_of(*joint, "parent");
      // What is fixed to the world stays a link.
      if (is_fixed(*joint) && parent != kWorld) joints_.emplace(end_of(*joint, "child"), joint);
    }
    for (const Element* link = robot.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      const char* const name = link->Attribute("name");
      if (name == nullptr || link->FirstChildElement("inertial") == nullptr) continue;
      // Up to where others came before.
      for (std::string at = name; heavy_.insert(at).second && joints_.contains(at);)
        at = end_of(*joints_.at(at), "parent");
    }
  }

  // Whether libsdformat stops at it.
  bool is_passed_over(const std::string& link) const {
    return joints_.contains(link) && !heavy_.contains(link);
  }

  // The link that `link` becomes a part of, and where it is in that.
  struct Place {
    std::string link;
    Pose pose;
  };
  absl::StatusOr<Place> place_of(const std::string& link) const {
    Place place{link, {}};
    for (std::size_t steps = 0; steps <= joints_.size(); ++steps) {  // as long as there is no circle
      const auto joint = joints_.find(place.link);
      if (joint == joints_.end()) break;
      const absl::StatusOr<Pose> origin = origin_of(*joint->second);
      if (!origin.ok()) return origin.status();
      place = {end_of(*joint->second, "parent"), *origin * place.pose};
    }
    return place;
  }

 private:
  absl::flat_hash_map<std::string, const Element*> joints_;  // by the child
  absl::flat_hash_set<std::string> heavy_;                   // links with a mass, or with one fixed to them
};

// "2 of 7 joints: a, b".
std::string share_of(std::size_t all, const char* what, const std::vector<std::string>& lost) {
  return absl::StrCat(lost.size(), " of ", all, " ", what, ": ", absl::StrJoin(lost, ", "));
}

std::size_t collisions_in(const Element& of_links) {
  std::size_t count = 0;
  for (const Element* link = of_links.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    for (const Element* collision = link->FirstChildElement("collision"); collision != nullptr;
         collision = collision->NextSiblingElement("collision")) {
      ++count;
    }
  }
  return count;
}

}  // namespace

void settle_urdf_world(Element& robot, Notices& notices) {
  Element* world = robot.FirstChildElement("link");
  while (world != nullptr && world->Attribute("name", kWorld) == nullptr)
    world = world->NextSiblingElement("link");
  if (world == nullptr || world->FirstChildElement("collision") == nullptr) return;
  notices.count_repair("link named world with a shape: it got the suffix _link, and is fixed to the world",
                       xml::place_of(*world));
  const std::string other = absl::StrCat(kWorld, "_link");
  world->SetAttribute("name", other.c_str());
  for (Element* part = robot.FirstChildElement(); part != nullptr; part = part->NextSiblingElement()) {
    if (part->Attribute("reference", kWorld) != nullptr) part->SetAttribute("reference", other.c_str());
    for (const char* end : {"parent", "child"}) {
      if (xml::is(*part, "joint") && end_of(*part, end) == kWorld)
        part->FirstChildElement(end)->SetAttribute("link", other.c_str());
    }
  }
  robot.InsertNewChildElement("link")->SetAttribute("name", kWorld);
  Element& joint = *robot.InsertNewChildElement("joint");
  joint.SetAttribute("name", absl::StrCat(other, "_fixed_to_world").c_str());
  joint.SetAttribute("type", "fixed");
  joint.InsertNewChildElement("parent")->SetAttribute("link", kWorld);
  joint.InsertNewChildElement("child")->SetAttribute("link", other.c_str());
}

absl::Status lift_joints(Element& robot) {
  const FixedLinks links(robot);
  for (Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const std::string parent = end_of(*joint, "parent");
    if (is_fixed(*joint) || !links.is_passed_over(parent)) continue;
    const auto place = links.place_of(parent);
    if (!place.ok()) return place.status();
    const absl::StatusOr<Pose> origin = origin_of(*joint);
    if (!origin.ok()) return origin.status();
    set_origin(*joint, place->pose * *origin);
    joint->FirstChildElement("parent")->SetAttribute("link", place->link.c_str());
  }
  return absl::OkStatus();
}

UrdfCensus::UrdfCensus(const Element& robot) : robot_(robot), collisions_(collisions_in(robot)) {
  for (const Element* part = robot.FirstChildElement(); part != nullptr; part = part->NextSiblingElement()) {
    const char* const name = part->Attribute("name");
    if (name == nullptr) continue;
    if (xml::is(*part, "link") && std::string(name) != kWorld) links_.emplace_back(name);
    if (xml::is(*part, "joint") && (!is_fixed(*part) || end_of(*part, "parent") == kWorld))
      joints_.emplace_back(name);
  }
}

absl::Status UrdfCensus::check(const Element& model) const {
  absl::flat_hash_set<std::string> names;
  for (const Element* part = model.FirstChildElement(); part != nullptr; part = part->NextSiblingElement()) {
    if (const char* const name = part->Attribute("name")) names.insert(name);
  }
  std::vector<std::string> faults;
  for (const auto& [what, all] : {std::pair{"links", &links_}, std::pair{"joints", &joints_}}) {
    std::vector<std::string> lost;
    for (const std::string& name : *all) {
      if (!names.contains(name)) lost.push_back(name);
    }
    if (!lost.empty()) faults.push_back(share_of(all->size(), what, lost));
  }
  const std::size_t left = collisions_in(model);
  if (left < collisions_)
    faults.push_back(absl::StrCat(collisions_ - left, " of ", collisions_, " collisions"));
  if (faults.empty()) return absl::OkStatus();
  return xml::invalid(robot_, "libsdformat would lose ", absl::StrJoin(faults, "; "));
}

}  // namespace tessera
