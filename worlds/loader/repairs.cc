#include "worlds/loader/repairs.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <string>

namespace tessera {

using xml::Element;

namespace {

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

}  // namespace

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
    if (name == nullptr || !others.contains(name)) continue;
    std::string other = absl::StrCat(name, "_joint");
    while (others.contains(other) || joints.contains(other)) absl::StrAppend(&other, "_joint");
    notices.count_repair("joint with the name of a link or frame, which got the suffix _joint",
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

}  // namespace tessera
