#include "worlds/loader/repairs.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <string>

namespace tessera {

using xml::Element;

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
  for (Element* joint = model.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* name = joint->Attribute("name");
    if (name == nullptr || !others.contains(name)) continue;
    std::string other = absl::StrCat(name, "_joint");
    while (others.contains(other) || joints.contains(other)) absl::StrAppend(&other, "_joint");
    notices.count_repair("joint with the name of a link or frame, which got the suffix _joint",
                         xml::place_of(*joint));
    joints.insert(other);
    joint->SetAttribute("name", other.c_str());
  }
}

}  // namespace tessera
