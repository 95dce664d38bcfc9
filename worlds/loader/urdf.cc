#include "worlds/loader/urdf.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "worlds/gazebo/urdf_extras.h"
#include "worlds/loader/elements.h"
#include "worlds/loader/file_search.h"
#include "worlds/loader/repairs.h"
#include "worlds/loader/sdf_parser.h"
#include "worlds/loader/urdf_joints.h"
#include "worlds/loader/urdf_masses.h"

namespace tessera {
namespace {

using xml::Element;

constexpr char kUnlimited[] = "1e16";  // SDF's number for it

// The names of materials that a robot defines more than once: urdfdom would refuse it.
void note_materials(const Element& robot, Notices& notices) {
  absl::flat_hash_set<std::string> names;
  for (const Element* material = robot.FirstChildElement("material"); material != nullptr;
       material = material->NextSiblingElement("material")) {
    const char* name = material->Attribute("name");
    if (name == nullptr || names.insert(name).second) continue;
    notices.count_repair("material that is defined twice", xml::place_of(*material));
  }
}

// Names of meshes that pass through libsdformat, which would change URIs. They are searched here, so that an
// error can name the place, and again when the model is read: there in the folder of the same file.
class MeshUris {
 public:
  absl::Status hide(Element& robot, const std::filesystem::path& directory, Notices& notices) {
    for (Element* link = robot.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      for (Element* collision = link->FirstChildElement("collision"); collision != nullptr;
           collision = collision->NextSiblingElement("collision")) {
        if (absl::Status status = hide_in(*collision, directory, notices); !status.ok()) return status;
      }
    }
    return absl::OkStatus();
  }

  void restore(Element& model) const {
    for (Element* link = model.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      for (Element* collision = link->FirstChildElement("collision"); collision != nullptr;
           collision = collision->NextSiblingElement("collision")) {
        Element* geometry = collision->FirstChildElement("geometry");
        Element* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
        Element* uri = mesh == nullptr ? nullptr : mesh->FirstChildElement("uri");
        if (uri == nullptr) continue;
        const auto found = uris_.find(xml::text_of(*uri));
        if (found != uris_.end()) uri->SetText(found->second.c_str());
      }
    }
  }

 private:
  absl::Status hide_in(Element& collision, const std::filesystem::path& directory, Notices& notices) {
    Element* geometry = collision.FirstChildElement("geometry");
    Element* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
    if (mesh == nullptr) return absl::OkStatus();
    const absl::StatusOr<std::string> uri = xml::required_attribute(*mesh, "filename");
    if (!uri.ok()) return uri.status();
    const absl::StatusOr<std::filesystem::path> file = find_uri(*uri, directory);
    if (absl::IsNotFound(file.status())) {
      notices.count_missing_file(*uri, xml::place_of(*mesh), file.status().message());
      geometry->DeleteChild(mesh);
      geometry->InsertNewChildElement("sphere")->SetAttribute("radius", "1");  // so that reading goes on
      return absl::OkStatus();
    }
    if (!file.ok()) return xml::error_at(*mesh, file.status().code(), file.status().message());
    const std::string name = absl::StrCat("tessera_mesh_", uris_.size());
    uris_.emplace(name, *uri);
    mesh->SetAttribute("filename", name.c_str());
    return absl::OkStatus();
  }

  absl::flat_hash_map<std::string, std::string> uris_;
};

void complete_limit(Element& limit, Notices& notices) {
  for (const char* attribute : {"effort", "velocity"}) {
    if (limit.Attribute(attribute) != nullptr) continue;
    notices.count_repair(absl::StrCat("<limit> without ", attribute, ", taken as unlimited"),
                         xml::place_of(limit));
    limit.SetAttribute(attribute, kUnlimited);
  }
  // libsdformat would exchange them without a word.
  double lower = 0;
  double upper = 0;
  if (limit.QueryDoubleAttribute("lower", &lower) == tinyxml2::XML_SUCCESS &&
      limit.QueryDoubleAttribute("upper", &upper) == tinyxml2::XML_SUCCESS && lower > upper) {
    notices.count_repair(kCrossedLimits, xml::place_of(limit));
  }
}

// urdfdom refuses joints without limits, or with <dynamics> that say nothing.
void complete_joint(Element& joint, Notices& notices) {
  Element* dynamics = joint.FirstChildElement("dynamics");
  if (dynamics != nullptr && dynamics->Attribute("damping") == nullptr &&
      dynamics->Attribute("friction") == nullptr) {
    notices.count_repair("<dynamics> without damping and friction, left out", xml::place_of(*dynamics));
    joint.DeleteChild(dynamics);
  }
  if (Element* limit = joint.FirstChildElement("limit")) return complete_limit(*limit, notices);
  const bool limited =
      joint.Attribute("type", "revolute") != nullptr || joint.Attribute("type", "prismatic") != nullptr;
  if (!limited) return;
  notices.count_repair("joint without <limit>, taken as unlimited", xml::place_of(joint));
  Element& limit = *joint.InsertNewChildElement("limit");
  limit.SetAttribute("lower", absl::StrCat("-", kUnlimited).c_str());
  for (const char* attribute : {"upper", "effort", "velocity"}) limit.SetAttribute(attribute, kUnlimited);
}

// It leaves out collisions with another number of scales than three.
void complete_scale(Element& mesh, Notices& notices) {
  const char* const scale = mesh.Attribute("scale");
  const absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(mesh, scale == nullptr ? "" : scale);
  if (scale == nullptr || !numbers.ok() || numbers->size() == 3) return;
  if (numbers->size() != 1 && numbers->size() < 3) return;
  notices.count_repair(
      "scale of a <mesh> that is not three numbers: one counts for all, and the first three of more",
      xml::place_of(mesh));
  const auto at = [&](std::size_t n) { return numbers->size() == 1 ? numbers->front() : (*numbers)[n]; };
  mesh.SetAttribute("scale", absl::StrFormat("%.17g %.17g %.17g", at(0), at(1), at(2)).c_str());
}

// It refuses collisions without a geometry that it knows, too.
void complete_link(Element& link, Notices& notices) {
  for (Element* collision = link.FirstChildElement("collision"); collision != nullptr;) {
    Element& element = *collision;
    collision = collision->NextSiblingElement("collision");
    Element* geometry = element.FirstChildElement("geometry");
    if (geometry != nullptr && geometry->FirstChildElement() != nullptr) {
      if (Element* mesh = geometry->FirstChildElement("mesh")) complete_scale(*mesh, notices);
      continue;
    }
    notices.count_repair("collision without geometry, left out", xml::place_of(element));
    link.DeleteChild(&element);
  }
}

void complete(Element& robot, Notices& notices) {
  for (Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    complete_joint(*joint, notices);
  }
  for (Element* link = robot.FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    complete_link(*link, notices);
  }
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
      const char* const name = collision->Attribute("name");
      collision->SetAttribute("name",
                              absl::StrCat(kCapsule, number++, "_", name == nullptr ? "" : name).c_str());
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

// A <mimic> of URDF, by the name of its joint: libsdformat drops it.
struct UrdfMimic {
  std::string leader;
  std::string multiplier = "1";
  std::string offset = "0";
};
using UrdfMimics = absl::flat_hash_map<std::string, UrdfMimic>;

absl::StatusOr<UrdfMimics> urdf_mimics_of(const Element& robot) {
  UrdfMimics result;
  for (const Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const Element* mimic = joint->FirstChildElement("mimic");
    if (mimic == nullptr) continue;
    const absl::StatusOr<std::string> name = xml::required_attribute(*joint, "name");
    if (!name.ok()) return name.status();
    const absl::StatusOr<std::string> leader = xml::required_attribute(*mimic, "joint");
    if (!leader.ok()) return leader.status();
    UrdfMimic& into = result[*name] = {*leader};
    for (const auto& [attribute, text] :
         {std::pair{"multiplier", &into.multiplier}, std::pair{"offset", &into.offset}}) {
      if (mimic->Attribute(attribute) == nullptr) continue;
      if (absl::Status status = xml::number_attribute(*mimic, attribute).status(); !status.ok())
        return status;
      *text = mimic->Attribute(attribute);
    }
  }
  return result;
}

// As SDF 1.11 has them.
void restore_mimics(Element& model, const UrdfMimics& mimics) {
  for (Element* joint = model.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* name = joint->Attribute("name");
    const auto found = mimics.find(name == nullptr ? "" : name);
    Element* axis = joint->FirstChildElement("axis");
    if (found == mimics.end() || axis == nullptr) continue;
    Element& mimic = *axis->InsertNewChildElement("mimic");
    mimic.SetAttribute("joint", found->second.leader.c_str());
    mimic.InsertNewChildElement("multiplier")->SetText(found->second.multiplier.c_str());
    mimic.InsertNewChildElement("offset")->SetText(found->second.offset.c_str());
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

// Gives links their poses in the model. libsdformat gives them along the chain of joints, and then goes along
// that chain for each link and each joint, again and again: for minutes, if it is long.
class LinksInModel {
 public:
  explicit LinksInModel(Element& model) {
    for (Element* element = model.FirstChildElement(); element != nullptr;
         element = element->NextSiblingElement()) {
      const char* name = element->Attribute("name");
      const bool has_pose = xml::is(*element, "link") || xml::is(*element, "joint");
      if (has_pose && name != nullptr) elements_.emplace(name, element);
    }
  }

  void write() {
    std::vector<std::pair<Element*, Pose>> poses;
    for (const auto& [name, element] : elements_) {
      Element* written = xml::is(*element, "link") ? element->FirstChildElement("pose") : nullptr;
      const std::optional<Pose> pose = in_model(name);
      if (written != nullptr && pose) poses.emplace_back(written, *pose);
    }
    for (const auto& [written, pose] : poses) xml::set_pose(*written, pose);
  }

 private:
  struct Step {
    std::string name;
    xml::RelativePose pose;
  };

  // Nothing where the way there has no end, or no beginning: libsdformat says why.
  std::optional<Pose> in_model(const std::string& name) {
    std::vector<Step> way;
    for (std::string at = name; !known_.contains(at); at = way.back().pose.relative_to) {
      const auto found = elements_.find(at);
      if (found == elements_.end() || way.size() > elements_.size()) return std::nullopt;
      const Element* written = found->second->FirstChildElement("pose");
      absl::StatusOr<xml::RelativePose> pose =
          written == nullptr ? xml::RelativePose{} : xml::pose_of(*written);
      if (!pose.ok()) return std::nullopt;
      if (pose->relative_to.empty() && xml::is(*found->second, "joint"))
        pose->relative_to = xml::child_text(*found->second, "child");
      way.push_back({at, *std::move(pose)});
    }
    for (auto step = way.rbegin(); step != way.rend(); ++step)
      known_[step->name] = Pose(known_.at(step->pose.relative_to)) * step->pose.pose;
    return known_.at(name);
  }

  absl::flat_hash_map<std::string, Element*> elements_;
  absl::flat_hash_map<std::string, Pose> known_{{"", Pose{}}, {"__model__", Pose{}}};
};

// A link on a fixed joint: libsdformat makes it part of its parent, and forgets its name.
struct FixedLink {
  std::string name;
  std::string parent;
  std::string pose;  // in the parent
};

std::vector<FixedLink> fixed_links(const Element& robot) {
  std::vector<FixedLink> links;
  for (const Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const Element* parent = joint->FirstChildElement("parent");
    const Element* child = joint->FirstChildElement("child");
    if (joint->Attribute("type", "fixed") == nullptr || parent == nullptr || child == nullptr) continue;
    const char* names[2] = {parent->Attribute("link"), child->Attribute("link")};
    if (names[0] == nullptr || names[1] == nullptr) continue;
    const Element* origin = joint->FirstChildElement("origin");
    const auto part = [&](const char* attribute) {
      const char* given = origin == nullptr ? nullptr : origin->Attribute(attribute);
      return given == nullptr ? "0 0 0" : given;
    };
    links.push_back({names[1], names[0], absl::StrCat(part("xyz"), " ", part("rpy"))});
  }
  return links;
}

// Those that are no longer there become frames of what they became part of.
void restore_fixed_links(Element& model, std::vector<FixedLink> lost) {
  absl::flat_hash_set<std::string> names;
  for (const Element* element = model.FirstChildElement(); element != nullptr;
       element = element->NextSiblingElement()) {
    if (const char* name = element->Attribute("name")) names.insert(name);
  }
  std::erase_if(lost, [&](const FixedLink& link) { return names.contains(link.name); });
  for (bool grown = true; grown;) {
    grown = false;
    for (const FixedLink& link : lost) {
      if (!names.contains(link.parent) || !names.insert(link.name).second) continue;
      Element& frame = *model.InsertNewChildElement("frame");
      frame.SetAttribute("name", link.name.c_str());
      frame.SetAttribute("attached_to", link.parent.c_str());
      frame.InsertNewChildElement("pose")->SetText(link.pose.c_str());
      grown = true;
    }
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<xml::File>> urdf_to_sdf(xml::File& file, ShapeSource shapes,
                                                       Notices& notices) {
  Element& robot = file.root();
  if (const char* name = robot.Attribute("name"); name == nullptr || *name == '\0') {
    notices.count_repair("robot without name, called robot", xml::place_of(robot));
    robot.SetAttribute("name", "robot");
  }
  note_materials(robot, notices);
  const gazebo::UrdfExtras extras(robot, notices);
  if (shapes == ShapeSource::kVisuals) {
    for (Element* link = robot.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link"))
      show_visuals(*link, file.directory(), notices);
  }
  remove_unread(robot, notices);
  rename_joints(robot, notices);
  complete(robot, notices);
  absl::flat_hash_map<std::string, std::string> unknown_joints;  // to libsdformat: names and types
  for (Element* joint = robot.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* type = joint->Attribute("type");
    const std::string type_name = type == nullptr ? "" : type;
    if (type_name != "spherical" && type_name != "planar" && type_name != "floating") continue;
    const absl::StatusOr<std::string> name = xml::required_attribute(*joint, "name");
    if (!name.ok()) return name.status();
    if (type_name != "spherical") notices.count_joint_left_out(type_name);
    unknown_joints[*name] = type_name;
    joint->SetAttribute("type", "continuous");
  }
  settle_urdf_world(robot, notices);
  if (absl::Status status = repair_urdf_masses(robot, notices); !status.ok()) return status;
  MeshUris meshes;
  if (absl::Status status = meshes.hide(robot, file.directory(), notices); !status.ok()) return status;
  hide_capsules(robot);
  const absl::StatusOr<UrdfMimics> mimics = urdf_mimics_of(robot);
  if (!mimics.ok()) return mimics.status();
  std::vector<FixedLink> fixed = fixed_links(robot);
  const UrdfCensus census(robot);
  if (absl::Status status = lift_joints(robot); !status.ok()) return status;

  const absl::StatusOr<std::string> converted = to_latest_sdf(xml::print(robot));
  if (!converted.ok()) return xml::invalid(robot, converted.status().message());
  absl::StatusOr<std::unique_ptr<xml::File>> result =
      xml::File::parse(*converted, absl::StrCat(file.name(), " (as SDF)"), file.directory());
  if (!result.ok()) return result.status();
  Element* model = (*result)->root().FirstChildElement("model");
  if (model == nullptr || model->FirstChildElement("link") == nullptr) {
    return xml::invalid(robot, "there is no <link>");
  }
  LinksInModel(*model).write();
  restore_mimics(*model, *mimics);
  restore_joints(*model, unknown_joints);
  restore_capsules(*model);
  restore_fixed_links(*model, std::move(fixed));
  meshes.restore(*model);
  extras.restore(*model, notices);
  if (absl::Status status = census.check(*model); !status.ok()) return status;
  return result;
}

}  // namespace tessera
