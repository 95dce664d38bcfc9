#include "worlds/loader/elements.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "lpss/base/nearest_word.h"
#include "worlds/loader/sdf_parser.h"
#include "worlds/loader/simulated_elements.h"

namespace tessera {
namespace {

using xml::Element;

// Elements of SDF that are newer than the parser.
constexpr std::array<absl::string_view, 4> kNewer = {"mimic", "fluid_added_mass", "auto_inertia_params",
                                                     "density"};

enum class Use { kRead, kNotSimulated };

// What URDF knows: an element, the one that it is in, and its attributes.
struct UrdfElement {
  absl::string_view parent;
  absl::string_view name;
  Use use = Use::kRead;
  absl::string_view attributes;  // separated by spaces
};
constexpr std::array kUrdf = {
    UrdfElement{"", "robot", Use::kRead, "name version xmlns"},
    UrdfElement{"robot", "link", Use::kRead, "name type"},
    UrdfElement{"robot", "joint", Use::kRead, "name type"},
    UrdfElement{"robot", "material", Use::kNotSimulated, ""},
    UrdfElement{"robot", "transmission", Use::kNotSimulated, ""},
    UrdfElement{"robot", "gazebo", Use::kRead, "reference"},
    UrdfElement{"gazebo", "mu1", Use::kRead, "value"},
    UrdfElement{"gazebo", "mu2", Use::kRead, "value"},
    UrdfElement{"gazebo", "fdir1", Use::kRead, "value"},
    UrdfElement{"robot", "sensor", Use::kNotSimulated, ""},
    UrdfElement{"robot", "ros2_control", Use::kNotSimulated, ""},
    UrdfElement{"robot", "mujoco", Use::kNotSimulated, ""},
    UrdfElement{"link", "inertial", Use::kRead, ""},
    UrdfElement{"link", "collision", Use::kRead, "name group concave"},
    UrdfElement{"link", "visual", Use::kNotSimulated, ""},
    UrdfElement{"link", "contact", Use::kNotSimulated, ""},
    UrdfElement{"link", "sensor", Use::kNotSimulated, ""},
    UrdfElement{"link", "self_collision_checking", Use::kNotSimulated, ""},
    UrdfElement{"inertial", "origin", Use::kRead, "xyz rpy"},
    UrdfElement{"inertial", "mass", Use::kRead, "value"},
    UrdfElement{"inertial", "inertia", Use::kRead, "ixx ixy ixz iyy iyz izz"},
    UrdfElement{"collision", "origin", Use::kRead, "xyz rpy"},
    UrdfElement{"collision", "geometry", Use::kRead, "name"},
    UrdfElement{"collision", "verbose", Use::kNotSimulated, ""},
    UrdfElement{"collision", "material", Use::kNotSimulated, ""},
    UrdfElement{"collision", "contact_coefficients", Use::kNotSimulated, ""},
    UrdfElement{"geometry", "box", Use::kRead, "size"},
    UrdfElement{"geometry", "sphere", Use::kRead, "radius"},
    UrdfElement{"geometry", "cylinder", Use::kRead, "radius length"},
    UrdfElement{"geometry", "capsule", Use::kRead, "radius length"},
    UrdfElement{"geometry", "mesh", Use::kRead, "filename scale"},
    UrdfElement{"joint", "origin", Use::kRead, "xyz rpy"},
    UrdfElement{"joint", "parent", Use::kRead, "link"},
    UrdfElement{"joint", "child", Use::kRead, "link"},
    UrdfElement{"joint", "axis", Use::kRead, "xyz"},
    UrdfElement{"joint", "limit", Use::kRead, "lower upper effort velocity"},
    UrdfElement{"joint", "dynamics", Use::kRead, "damping friction"},
    UrdfElement{"joint", "mimic", Use::kRead, "joint multiplier offset"},
    UrdfElement{"joint", "safety_controller", Use::kNotSimulated, ""},
    UrdfElement{"joint", "calibration", Use::kNotSimulated, ""},
    // Of Drake, and of Gazebo and ROS before they settled.
    UrdfElement{"robot", "frame", Use::kNotSimulated, ""},
    UrdfElement{"robot", "loop_joint", Use::kNotSimulated, ""},
    UrdfElement{"robot", "force_element", Use::kNotSimulated, ""},
    UrdfElement{"joint", "joint_properties", Use::kNotSimulated, ""},
    UrdfElement{"joint", "controller_gains", Use::kNotSimulated, ""},
    UrdfElement{"joint", "traits", Use::kNotSimulated, ""},
};

template <std::size_t N>
bool holds(const std::array<absl::string_view, N>& names, absl::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// "; the nearest known is <inertial>", or nothing where all known words are far.
std::string nearest(absl::string_view name, const std::vector<std::string>& known, const char* open,
                    const char* close) {
  const std::vector<absl::string_view> words(known.begin(), known.end());
  const absl::string_view word = nearest_word(name, words);
  return word.empty() ? "" : absl::StrCat("; the nearest known is ", open, word, close);
}

void count_unknown(absl::string_view name, absl::string_view parent, const std::vector<std::string>& known,
                   const std::string& where, Notices& notices) {
  notices.count_repair(absl::StrCat("unknown element <", name, "> in <", parent, ">, left out",
                                    nearest(name, known, "<", ">")),
                       where);
}

bool is_known(const sdf::Element& parent, const std::string& name) {
  // Names with a prefix are extensions, which SDF allows anywhere.
  return parent.HasElementDescription(name) || holds(kNewer, name) || absl::StrContains(name, ":");
}

bool has_default(const sdf::Element& element) {
  const sdf::ParamPtr value = element.GetValue();
  return value != nullptr && value->GetAsString() == value->GetDefaultAsString();
}

// Whether SDF allows some; the description of an element is without those that the file does not have.
bool has_children(const sdf::Element& element) {
  if (element.GetElementDescriptionCount() > 0) return true;
  return element.GetValue() == nullptr && !sdf_words_in(element.GetName()).empty();
}

// An element with a name, and the way from it to one below: "<surface><friction>" of a <collision>.
struct Way {
  std::string owner;  // "<collision>"
  std::string where;  // "<collision name='c'>"
  std::string path;
};

Way way_to(const sdf::Element& element, const Way& parent) {
  if (element.HasAttribute("name") && element.GetAttribute("name")->GetSet()) {
    const std::string name = element.GetAttribute("name")->GetAsString();
    return {absl::StrCat("<", element.GetName(), ">"),
            absl::StrCat("<", element.GetName(), " name='", name, "'>"), ""};
  }
  return {parent.owner, parent.where, absl::StrCat(parent.path, "<", element.GetName(), ">")};
}

void note_children(const sdf::Element& parent, const Way& way, Notices& notices);

void note_child(const sdf::Element& parent, const sdf::Element& child, const Way& way, Notices& notices) {
  const std::string& name = child.GetName();
  if (absl::StartsWith(name, "tessera:")) return;  // ours, checked before
  if (!is_known(parent, name)) {
    count_unknown(name, parent.GetName(), sdf_words_in(parent.GetName()), way.where, notices);
    return;
  }
  const bool described = parent.HasElementDescription(name);
  if (described && has_children(child)) {
    note_children(child, way_to(child, way), notices);
  } else if (!described || (!is_simulated(parent.GetName(), name) && child.GetExplicitlySetInFile() &&
                            !has_default(child))) {
    notices.count(absl::StrCat(way.path, "<", name, "> of ", way.owner, " not simulated"));
  }
}

void note_children(const sdf::Element& parent, const Way& way, Notices& notices) {
  for (sdf::ElementPtr child = parent.GetFirstElement(); child != nullptr; child = child->GetNextElement()) {
    note_child(parent, *child, way, notices);
  }
}

const UrdfElement* find_urdf(absl::string_view parent, absl::string_view name) {
  const auto found = std::ranges::find_if(
      kUrdf, [&](const UrdfElement& one) { return one.parent == parent && one.name == name; });
  return found == kUrdf.end() ? nullptr : &*found;
}

std::vector<std::string> known_in_urdf(absl::string_view parent) {
  std::vector<std::string> names;
  for (const UrdfElement& one : kUrdf) {
    if (one.parent == parent) names.emplace_back(one.name);
  }
  return names;
}

void count_unused(const Element& element, Notices& notices) {
  const Element& parent = *element.Parent()->ToElement();
  const char* where = xml::is(parent, "gazebo") ? "<gazebo>" : "";
  notices.count(absl::StrCat(where, "<", element.Name(), "> ",
                             is_no_physics(element.Name()) ? fate_of(element.Name()) : "not simulated"));
}

// Settings of many kinds, none of them unknown. Those that are read are for a link.
bool is_setting_of_gazebo(const Element& parent, const UrdfElement* known) {
  return xml::is(parent, "gazebo") && (known == nullptr || parent.Attribute("reference") == nullptr);
}

void note_attributes(const Element& element, const UrdfElement& known, Notices& notices) {
  const std::vector<std::string> names = absl::StrSplit(known.attributes, ' ', absl::SkipEmpty());
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr;
       attribute = attribute->Next()) {
    const absl::string_view name = attribute->Name();
    if (absl::StrContains(name, ":") || std::ranges::find(names, name) != names.end()) continue;
    notices.count_repair(absl::StrCat("unknown attribute ", name, " of <", element.Name(), ">, left out",
                                      nearest(name, names, "", "")),
                         xml::place_of(element));
  }
}

void remove_unread_children(Element& parent, Notices& notices) {
  for (Element* child = parent.FirstChildElement(); child != nullptr;) {
    Element& element = *child;
    child = child->NextSiblingElement();
    const UrdfElement* known = find_urdf(parent.Name(), element.Name());
    const bool is_setting = is_setting_of_gazebo(parent, known);
    if (known != nullptr && known->use == Use::kRead && !is_setting) {
      note_attributes(element, *known, notices);
      remove_unread_children(element, notices);
      continue;
    }
    if (known != nullptr || is_setting || absl::StrContains(element.Name(), ":")) {
      count_unused(element, notices);
    } else {
      count_unknown(element.Name(), parent.Name(), known_in_urdf(parent.Name()), xml::place_of(element),
                    notices);
    }
    parent.DeleteChild(&element);
  }
}

}  // namespace

void note_unread(const sdf::Element& model, Notices& notices) {
  note_children(model, {"<model>", "the model itself", ""}, notices);
}

void note_unread(const Element& element, Notices& notices) {
  const Element& parent = *element.Parent()->ToElement();
  if (is_simulated(parent.Name(), element.Name())) return;
  const sdf::Element& description = *sdf_description(parent.Name());
  if (is_known(description, element.Name())) {
    const std::string what = xml::is(parent, "physics") ? "<physics>" : "";
    notices.count(absl::StrCat(what, "<", element.Name(), "> skipped"));
  } else {
    count_unknown(element.Name(), parent.Name(), sdf_words_in(parent.Name()), xml::place_of(element),
                  notices);
  }
}

void remove_unread(Element& robot, Notices& notices) {
  note_attributes(robot, *find_urdf("", "robot"), notices);
  remove_unread_children(robot, notices);
}

}  // namespace tessera
