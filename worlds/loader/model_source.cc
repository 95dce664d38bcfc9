#include "worlds/loader/model_source.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "lpss/base/nearest_word.h"
#include "lpss/model/limits.h"
#include "worlds/gazebo/sensors.h"
#include "worlds/gazebo/systems.h"
#include "worlds/loader/builtin_models.h"
#include "worlds/loader/file_search.h"
#include "worlds/loader/fuel_cache.h"
#include "worlds/loader/given_geometry.h"
#include "worlds/loader/joint_reader.h"
#include "worlds/loader/left_out.h"
#include "worlds/loader/merge.h"
#include "worlds/loader/program_reader.h"
#include "worlds/loader/repairs.h"
#include "worlds/loader/sdf_masses.h"
#include "worlds/loader/sdf_parser.h"
#include "worlds/loader/simulated_elements.h"
#include "worlds/loader/surface_reader.h"
#include "worlds/loader/urdf.h"

namespace tessera {
namespace {

using std::filesystem::path;
using xml::Element;

constexpr char kSlot[] = "tessera:slot";

// Limit on models from nested includes: a few small files can request any number of copies of each other.
constexpr std::size_t kIncludedBytesMax = std::size_t{32} << 20;

template <std::size_t N>
bool is_one_of(const Element& element, const std::array<absl::string_view, N>& names) {
  return std::find(names.begin(), names.end(), element.Name()) != names.end();
}

constexpr std::array<absl::string_view, 7> kKnownGeometries = {"box",       "sphere", "capsule", "cylinder",
                                                               "ellipsoid", "plane",  "mesh"};
constexpr std::array<absl::string_view, 9> kJointTypes = {
    "ball", "continuous", "fixed", "gearbox", "prismatic", "revolute", "revolute2", "screw", "universal"};
// Elements of our own, in place of what libsdformat does not support.
constexpr std::array<absl::string_view, 9> kKept = {
    "tessera:auto_inertia", "tessera:density", kKeptDrives, kKeptArmatures, kKeptMimic,
    kKeptThreadPitch,       kSurfaceMotion,    kTrigger,    kProgram};
// libsdformat would accept any number, even NaN; here the error can still name the line.
constexpr std::array<absl::string_view, 18> kNumbers = {"mass",         "ixx",
                                                        "ixy",          "ixz",
                                                        "iyy",          "iyz",
                                                        "izz",          "mu",
                                                        "mu2",          "fdir1",
                                                        "friction2",    "coefficient",
                                                        "patch_radius", "rolling_friction",
                                                        "normal",       "scale",
                                                        "density",      "restitution_coefficient"};
constexpr std::array<absl::string_view, 4> kSizes = {"size", "radius", "length", "radii"};

absl::Status check_numbers(const Element& element) {
  if (xml::is(element, "pose")) return xml::pose_of(element).status();
  const bool is_size = is_one_of(element, kSizes);
  if (!is_size && !is_one_of(element, kNumbers)) return absl::OkStatus();
  const absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(element, xml::text_of(element));
  if (!numbers.ok()) return numbers.status();
  const Element* parent = element.Parent()->ToElement();
  // The size of a plane is for display only; its collision shape is infinite.
  if (!is_size || parent == nullptr || xml::is(*parent, "plane")) return absl::OkStatus();
  for (double number : *numbers) {
    if (number < kExtentMin) return xml::invalid(element, number, " m must be at least ", kExtentMin, " m");
    if (number > kStaticExtentMax) {
      return xml::invalid(element, number, " m must be at most ", kStaticExtentMax, " m");
    }
  }
  return absl::OkStatus();
}

absl::Status check_prefix(const Element& element) {
  if (absl::StartsWith(element.Name(), "tessera:")) {
    return xml::invalid(element, "unknown or misplaced tessera: element");
  }
  for (const auto* attribute = element.FirstAttribute(); attribute != nullptr;
       attribute = attribute->Next()) {
    if (absl::StartsWith(attribute->Name(), "tessera:")) {
      return xml::invalid(element, "unknown attribute ", attribute->Name());
    }
  }
  return absl::OkStatus();
}

bool says_true(const std::string& text) { return text == "true" || text == "1" || text == "True"; }

// SDF 1.11's automatic inertia, in a way that survives a parser for 1.9.
void keep_auto_inertia(Element& link) {
  const Element* inertial = link.FirstChildElement("inertial");
  const char* automatic = inertial == nullptr ? nullptr : inertial->Attribute("auto");
  if (automatic == nullptr) return;
  if (says_true(automatic)) {
    link.InsertNewChildElement("tessera:auto_inertia");
    const std::string density = xml::child_text(*inertial, "density");
    for (Element* c = link.FirstChildElement("collision"); c != nullptr;
         c = c->NextSiblingElement("collision")) {
      Element* own = c->FirstChildElement("density");
      const std::string value = own == nullptr ? density : xml::text_of(*own);
      if (!value.empty()) c->InsertNewChildElement("tessera:density")->SetText(value.c_str());
      if (own != nullptr) c->DeleteChild(own);
    }
  }
  link.DeleteChild(link.FirstChildElement("inertial"));
}

void set_static(Element& model, std::optional<bool> value) {
  if (!value) return;
  while (Element* old = model.FirstChildElement("static")) model.DeleteChild(old);
  model.InsertNewChildElement("static")->SetText(*value);
}

void add_pose(const std::string& pose_xml, Element& model) {
  if (pose_xml.empty()) return;
  tinyxml2::XMLDocument document;
  if (document.Parse(pose_xml.c_str(), pose_xml.size()) != tinyxml2::XML_SUCCESS) return;
  Element& pose = xml::copy_into(*document.RootElement(), model);
  // The name of the attribute before SDF 1.7, where an empty one was common.
  const char* frame = pose.Attribute("frame");
  if (frame == nullptr) return;
  if (*frame != '\0') pose.SetAttribute("relative_to", frame);
  pose.DeleteAttribute("frame");
}

std::string plugins_of(const Element& include) {
  std::string text;
  for (const Element* plugin = include.FirstChildElement("plugin"); plugin != nullptr;
       plugin = plugin->NextSiblingElement("plugin")) {
    absl::StrAppend(&text, xml::print(*plugin));
  }
  return text;
}

absl::Status merge(const Element& source, const std::string& name, const std::string& pose_xml,
                   Element& model) {
  // As libsdformat calls it.
  const absl::StatusOr<Element*> frame =
      merge_model(source, absl::StrCat("_merged__", name, "__model__"), model);
  if (!frame.ok()) return frame.status();
  add_pose(pose_xml, **frame);
  Element* pose = (*frame)->FirstChildElement("pose");
  if (pose == nullptr) pose = (*frame)->InsertNewChildElement("pose");
  const char* const relative_to = pose->Attribute("relative_to");
  if (relative_to == nullptr || *relative_to == '\0') pose->SetAttribute("relative_to", "__model__");
  return absl::OkStatus();
}

bool is_merge(const Element& include) {
  const char* const merge = include.Attribute("merge");
  return merge != nullptr && says_true(merge);
}

absl::Status check_include(const Element& include) {
  constexpr std::array<absl::string_view, 6> kKnown = {"uri",    "name",   "pose",
                                                       "static", "plugin", "placement_frame"};
  if (absl::Status status = check_prefix(include); !status.ok()) return status;
  if (is_merge(include)) {
    if (!xml::is(*include.Parent()->ToElement(), "model"))
      return xml::invalid(include, "merge='true' is for an <include> in a <model>");
    if (include.FirstChildElement("placement_frame") != nullptr)
      return xml::invalid(include, "<placement_frame> with merge='true' is not supported");
  }
  for (const Element* child = include.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (absl::Status status = check_prefix(*child); !status.ok()) return status;
    const bool is_of_others = absl::StrContains(child->Name(), ':');  // as gz-sim's <experimental:params>
    if (!is_of_others && !is_one_of(*child, kKnown))
      return xml::invalid(*child, "unknown element in an <include>");
  }
  return absl::OkStatus();
}

// Whether all numbers of a shape are 0, which then is no more than a point. The size of a plane is for
// display.
bool is_point(const Element& shape) {
  bool some = false;
  if (xml::is(shape, "plane")) return false;
  for (const Element* size = shape.FirstChildElement(); size != nullptr; size = size->NextSiblingElement()) {
    if (!is_one_of(*size, kSizes)) return false;
    const absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(*size, xml::text_of(*size));
    if (!numbers.ok()) return false;
    if (std::any_of(numbers->begin(), numbers->end(), [](double number) { return number != 0; }))
      return false;
    some = some || !numbers->empty();
  }
  return some;
}

// Whether a collision is supported; unsupported ones are counted.
bool has_known_geometry(const Element& collision, Notices& notices) {
  const Element* geometry = collision.FirstChildElement("geometry");
  const Element* kind = geometry == nullptr ? nullptr : geometry->FirstChildElement();
  if (kind != nullptr && is_point(*kind)) {
    notices.count_repair("collision of no size, left out", xml::place_of(collision));
    return false;
  }
  if (kind != nullptr && (is_one_of(*kind, kKnownGeometries) || is_given(*kind))) return true;
  if (kind == nullptr || xml::is(*kind, "empty")) {
    notices.count("collision without geometry, skipped");
    return false;
  }
  const absl::string_view nearest = nearest_word(kind->Name(), kKnownGeometries);
  notices.count(absl::StrCat("collision with the geometry <", kind->Name(),
                             ">, which is not supported, skipped",
                             nearest.empty() ? "" : absl::StrCat("; the nearest known is <", nearest, ">")));
  return false;
}

absl::Status check_joint_type(const Element& joint) {
  const char* type = joint.Attribute("type");
  if (type == nullptr || std::ranges::find(kJointTypes, absl::string_view(type)) != kJointTypes.end())
    return absl::OkStatus();
  const absl::string_view nearest = nearest_word(type, kJointTypes);
  return xml::invalid(joint, absl::StrCat("type='", type, "' is none of ", absl::StrJoin(kJointTypes, ", "),
                                          nearest.empty() ? "" : absl::StrCat("; the nearest is ", nearest)));
}

}  // namespace

std::string ModelSource::document(std::optional<bool> is_static) const {
  tinyxml2::XMLDocument document;
  document.InsertEndChild(element->DeepClone(&document));
  Element& model = *document.RootElement();
  model.SetAttribute("name", kAnyModel);
  set_static(model, is_static);
  return absl::StrCat("<sdf version='", version, "'>", xml::print(model), "</sdf>");
}

absl::StatusOr<std::string> sdf_version(const Element& root, Notices& notices) {
  const absl::StatusOr<std::string> version = xml::required_attribute(root, "version");
  if (!version.ok()) return version.status();
  const std::vector<absl::string_view> parts = absl::StrSplit(*version, '.');
  int minor = 0;
  if (parts.size() != 2 || parts[0] != "1" || !absl::SimpleAtoi(parts[1], &minor) || minor < 0) {
    return xml::invalid(root, "version '", *version, "' must be 1.0 to ", latest_sdf_version());
  }
  constexpr int kMinorMax = 9;
  if (minor <= kMinorMax) return *version;
  notices.count(absl::StrCat("file in SDF ", *version, ", read as ", latest_sdf_version()));
  return latest_sdf_version();
}

absl::StatusOr<ModelSource> ModelSources::prepare(Element& model, const std::string& version,
                                                  const path& directory) {
  ModelSource result;
  result.version = version;
  const absl::StatusOr<std::string> name = xml::required_attribute(model, "name");
  if (!name.ok()) return name.status();
  result.name = *name;
  if (const char* frame = model.Attribute("placement_frame")) result.placement_frame = frame;
  if (Element* pose = model.FirstChildElement("pose")) {
    absl::StatusOr<xml::RelativePose> parsed = xml::pose_of(*pose);
    if (!parsed.ok()) return parsed.status();
    result.pose = *std::move(parsed);
    xml::write_as_quaternion(*pose);
    result.pose_xml = xml::print(*pose);
    model.DeleteChild(pose);
  }
  Includes includes;
  if (absl::Status status = clean(model, directory, includes, result.notices); !status.ok()) return status;
  const std::vector<Slot>& slots = includes.slots;
  model.DeleteAttribute("placement_frame");
  result.element = &model;
  const bool mixed = std::any_of(slots.begin(), slots.end(), [&](const Slot& slot) {
    return slot.model->version != version || (slot.is_merged && version != latest_sdf_version());
  });
  if (mixed) {
    absl::StatusOr<Element*> latest = to_latest(model, version);
    if (!latest.ok()) return xml::invalid(model, latest.status().message());
    result.element = *latest;
    result.version = latest_sdf_version();
  }
  if (absl::Status status = fill(*result.element, result.version, slots); !status.ok()) return status;
  if (includes.lacks_some && !remove_dangling(*result.element, result.notices)) {
    result.notices.count_loss("<model> with nothing but what was left out, skipped");
    result.is_empty = true;
  }
  return result;
}

absl::Status ModelSources::clean(Element& element, const path& directory, Includes& includes,
                                 Notices& notices) {
  if (absl::Status status = check_prefix(element); !status.ok()) return status;
  if (absl::Status status = check_numbers(element); !status.ok()) return status;
  if (xml::is(element, "pose")) xml::write_as_quaternion(element);
  const bool in_model = xml::is(element, "model");
  if (in_model && says_true(xml::child_text(element, "static"))) {
    for (Element* link = element.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      if (Element* inertial = link->FirstChildElement("inertial")) link->DeleteChild(inertial);
    }
  }
  if (in_model) {
    settle_world_link(element, notices);
    rename_joints(element, notices);
    if (absl::Status status = repair_massless_links(element, notices); !status.ok()) return status;
    const gazebo::ModelParts parts(element);
    gazebo::take_systems(parts, notices);
    gazebo::take_sensors(parts, notices);
  }
  if (xml::is(element, "inertial")) {
    if (absl::Status status = repair_inertial(element, notices); !status.ok()) return status;
  }
  if (xml::is(element, "link")) {
    if (shapes_ == ShapeSource::kVisuals) show_visuals(element, directory, notices);
    rename_collisions(element, notices);
    keep_auto_inertia(element);
    if (absl::Status status = keep_surface_motion(element); !status.ok()) return status;
    if (absl::Status status = keep_programs(element, directory, modules_, notices); !status.ok())
      return status;
  }
  if (absl::Status status = keep_trigger(element); !status.ok()) return status;
  if (xml::is(element, "geometry")) {
    for (Element* shape = element.FirstChildElement(); shape != nullptr; shape = shape->NextSiblingElement())
      repair_sizes(*shape, notices);
  }
  if (xml::is(element, "friction")) {
    for (Element* engine = element.FirstChildElement(); engine != nullptr;
         engine = engine->NextSiblingElement()) {
      repair_friction(*engine, notices);
    }
  }
  if (xml::is(element, "joint")) {
    if (absl::Status status = check_joint_type(element); !status.ok()) return status;
    if (absl::Status status = prepare_joint(element); !status.ok()) return status;
  }
  for (Element* child = element.FirstChildElement(); child != nullptr;) {
    Element* const next = child->NextSiblingElement();
    absl::Status status;
    if (is_no_physics(child->Name())) {
      notices.count(absl::StrCat("<", child->Name(), "> ", fate_of(child->Name())));
      element.DeleteChild(child);
    } else if (xml::is(*child, "collision") && !has_known_geometry(*child, notices)) {
      element.DeleteChild(child);
    } else if (in_model && xml::is(*child, "include")) {
      status = take_include(*child, directory, includes, notices);
    } else if (is_given(*child) && xml::is(element, "geometry")) {
      return take_given(*child, directory, notices);
    } else if (!is_one_of(*child, kKept)) {
      if (xml::is(*child, "mesh")) status = take_mesh(*child, directory, notices);
      if (status.ok()) status = clean(*child, directory, includes, notices);
    }
    if (!status.ok()) return status;
    child = next;
  }
  return absl::OkStatus();
}

// In the place of all of the geometry.
absl::Status ModelSources::take_given(const Element& kind, const path& directory, Notices& notices) {
  Element& geometry = *const_cast<Element&>(kind).Parent()->ToElement();
  absl::StatusOr<GivenGeometry> given = given_geometry(kind, directory, notices);
  if (!given.ok()) return given.status();
  geometry.DeleteChildren();
  const std::string name = meshes_.add(*std::move(given));
  geometry.InsertNewChildElement("mesh")->InsertNewChildElement("uri")->SetText(name.c_str());
  return absl::OkStatus();
}

absl::Status ModelSources::take_mesh(Element& mesh, const path& directory, Notices& notices) {
  Element* uri = mesh.FirstChildElement("uri");
  if (uri == nullptr) return xml::invalid(mesh, "the <uri> is missing");
  const std::string given = xml::text_of(*uri);
  const absl::StatusOr<path> file = find_uri(given, directory);
  if (absl::IsNotFound(file.status())) {
    // Something in its place, so that reading goes on.
    notices.count_missing_file(given, xml::place_of(*uri), file.status().message());
    uri->SetText(meshes_.add(stand_in()).c_str());
    return absl::OkStatus();
  }
  if (!file.ok()) return xml::error_at(*uri, file.status().code(), file.status().message());
  const absl::StatusOr<std::size_t> parts = take_optimization(mesh, notices);
  if (!parts.ok()) return parts.status();
  const std::string name = *parts > 0 ? meshes_.add(DividedMesh{file->string(), *parts}) : file->string();
  uri->SetText(name.c_str());
  return absl::OkStatus();
}

absl::Status ModelSources::take_include(Element& include, const path& directory, Includes& includes,
                                        Notices& notices) {
  const absl::StatusOr<const ModelSource*> model = included(include, directory, notices);
  if (!model.ok()) return model.status();
  Element& parent = *include.Parent()->ToElement();
  if (*model == nullptr) {
    includes.lacks_some = true;
  } else {
    bytes_ += xml::print(*(*model)->element).size();
    if (bytes_ > kIncludedBytesMax) {
      return xml::invalid(include, "all nested includes together are ", bytes_,
                          " bytes; they must be at most ", kIncludedBytesMax);
    }
    Slot slot{*model, xml::child_text(include, "name"), "", xml::child_text(include, "placement_frame"), {}};
    slot.is_merged = is_merge(include);
    if (Element* pose = include.FirstChildElement("pose")) {
      if (absl::Status status = xml::pose_of(*pose).status(); !status.ok()) return status;
      xml::write_as_quaternion(*pose);
      slot.pose_xml = xml::print(*pose);
    }
    if (Element* value = include.FirstChildElement("static")) {
      const absl::StatusOr<bool> is_static = xml::bool_of(*value);
      if (!is_static.ok()) return is_static.status();
      slot.is_static = *is_static;
    }
    Element* marker = parent.GetDocument()->NewElement(kSlot);
    marker->SetAttribute("n", static_cast<unsigned>(includes.slots.size()));
    parent.InsertAfterChild(&include, marker);
    includes.slots.push_back(std::move(slot));
    notices.add((*model)->notices);
  }
  parent.DeleteChild(&include);
  return absl::OkStatus();
}

absl::StatusOr<Element*> ModelSources::to_latest(const Element& model, const std::string& version) {
  const absl::StatusOr<std::string> text =
      to_latest_sdf(absl::StrCat("<sdf version='", version, "'>", xml::print(model), "</sdf>"));
  if (!text.ok()) return text.status();
  absl::StatusOr<std::unique_ptr<xml::File>> file = xml::File::parse(*text, "converted model", "");
  if (!file.ok()) return file.status();
  converted_.push_back(*std::move(file));
  Element* result = converted_.back()->root().FirstChildElement("model");
  if (result == nullptr) return absl::InvalidArgumentError("libsdformat returned no model");
  return result;
}

absl::Status ModelSources::fill(Element& model, const std::string& version, const std::vector<Slot>& slots) {
  for (Element* child = model.FirstChildElement(); child != nullptr;) {
    Element* const next = child->NextSiblingElement();
    if (xml::is(*child, "model")) {
      if (absl::Status status = fill(*child, version, slots); !status.ok()) return status;
    } else if (xml::is(*child, kSlot)) {
      const Slot& slot = slots[child->UnsignedAttribute("n")];
      const ModelSource& source = *slot.model;
      const Element* element = source.element;
      if (source.version != version) {
        const absl::StatusOr<Element*> latest = to_latest(*element, source.version);
        if (!latest.ok()) return latest.status();
        element = *latest;
      }
      const std::string& name = slot.name.empty() ? source.name : slot.name;
      const std::string& pose = slot.pose_xml.empty() ? source.pose_xml : slot.pose_xml;
      if (slot.is_merged) {
        if (absl::Status status = merge(*element, name, pose, model); !status.ok()) return status;
        model.DeleteChild(child);
        child = next;
        continue;
      }
      Element& copy = xml::copy_into(*element, model);
      copy.SetAttribute("name", name.c_str());
      const std::string& placement =
          slot.placement_frame.empty() ? source.placement_frame : slot.placement_frame;
      if (!placement.empty()) copy.SetAttribute("placement_frame", placement.c_str());
      set_static(copy, slot.is_static);
      add_pose(pose, copy);
      model.DeleteChild(child);
    }
    child = next;
  }
  return absl::OkStatus();
}

absl::Status ModelSources::read_file(const Element& include, IncludedFile& entry, Notices& notices) {
  if (xml::is(entry.file->root(), "robot")) {
    absl::StatusOr<std::unique_ptr<xml::File>> converted = urdf_to_sdf(*entry.file, shapes_, notices);
    if (!converted.ok()) return converted.status();
    entry.file = *std::move(converted);
  }
  Element& root = entry.file->root();
  rename_root(root, notices);
  if (!xml::is(root, "sdf")) return xml::invalid(root, "an included file must be <sdf> or <robot>");
  const absl::StatusOr<std::string> version = sdf_version(root, notices);
  if (!version.ok()) return version.status();
  Element* model = root.FirstChildElement("model");
  if (model == nullptr) {
    if (root.FirstChildElement("light") == nullptr && root.FirstChildElement("actor") == nullptr) {
      return xml::invalid(root, "an included file must hold a <model>");
    }
    return absl::OkStatus();
  }
  for (const Element* plugin = include.FirstChildElement("plugin"); plugin != nullptr;
       plugin = plugin->NextSiblingElement("plugin")) {
    xml::copy_into(*plugin, *model);
  }
  if (++depth_ > kIncludeDepthMax) {
    return xml::invalid(include, "includes are nested deeper than ", kIncludeDepthMax);
  }
  absl::StatusOr<ModelSource> source = prepare(*model, *version, entry.file->directory());
  --depth_;
  if (!source.ok()) return source.status();
  entry.model = *std::move(source);
  return absl::OkStatus();
}

absl::StatusOr<const ModelSource*> ModelSources::included_file(const Element& include,
                                                               const std::string& name, const char* builtin,
                                                               Notices& notices) {
  const std::string key = absl::StrCat(name, plugins_of(include));
  std::unique_ptr<IncludedFile>& slot = files_[key];
  if (slot == nullptr) {
    slot = std::make_unique<IncludedFile>();
    IncludedFile& entry = *slot;  // reading other files may move the slot, not what it points to
    absl::StatusOr<std::unique_ptr<xml::File>> file =
        builtin == nullptr ? xml::File::read(name) : xml::File::parse(builtin, name, "");
    if (!file.ok()) return xml::error_at(include, file.status().code(), file.status().message());
    entry.file = *std::move(file);
    if (absl::Status status = read_file(include, entry, notices); !status.ok()) return status;
    entry.reading = false;
  }
  const IncludedFile& entry = *files_[key];
  if (entry.reading) {
    return xml::invalid(*include.FirstChildElement("uri"), "'", xml::child_text(include, "uri"),
                        "' includes itself, directly or through others");
  }
  if (!entry.model) {
    notices.count("<include> of a file without model, skipped");
    return nullptr;
  }
  if (!entry.model->is_empty) return &*entry.model;
  notices.add(entry.model->notices);
  return nullptr;
}

absl::StatusOr<const ModelSource*> ModelSources::included(const Element& include, const path& directory,
                                                          Notices& notices) {
  const Element* uri = include.FirstChildElement("uri");
  if (uri == nullptr) return xml::invalid(include, "the <uri> is missing");
  if (absl::Status status = check_include(include); !status.ok()) return status;
  for (const Element* child = include.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (absl::StrContains(child->Name(), ':')) notices.count(absl::StrCat("<", child->Name(), "> skipped"));
  }
  const std::string text = xml::text_of(*uri);
  const absl::StatusOr<path> file = find_model(text, directory);
  if (file.ok()) {
    std::error_code error;
    const path real = std::filesystem::weakly_canonical(*file, error);
    return included_file(include, (error ? *file : real).string(), nullptr, notices);
  }
  if (is_remote(text) || absl::IsNotFound(file.status())) {
    if (const char* builtin = builtin_model(text)) return included_file(include, text, builtin, notices);
    if (is_remote(text)) {
      notices.count_remote_model(text);
    } else {
      notices.count_missing_file(text, xml::place_of(*uri), file.status().message());
    }
    return nullptr;
  }
  return xml::error_at(*uri, file.status().code(), file.status().message());
}

}  // namespace tessera
