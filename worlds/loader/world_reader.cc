#include "worlds/loader/world_reader.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "lpss/programs/registry.h"
#include "worlds/gazebo/detachable.h"
#include "worlds/gazebo/fluids.h"
#include "worlds/gazebo/systems.h"
#include "worlds/loader/elements.h"
#include "worlds/loader/model_source.h"
#include "worlds/loader/model_template.h"
#include "worlds/loader/program_reader.h"
#include "worlds/loader/repairs.h"
#include "worlds/loader/shape_table.h"
#include "worlds/loader/tessera_elements.h"
#include "worlds/loader/urdf.h"
#include "worlds/loader/world_joint.h"
#include "worlds/loader/world_settings.h"
#include "worlds/mjcf/reader.h"

namespace tessera {
namespace {

using xml::Element;

// A named element with a pose, of the world, a site or a frame that moves: a model, a frame, a joint, or the
// site or the frame that moves itself.
struct Placed {
  enum class State { kNew, kResolving, kResolved };

  std::string name;
  const Element* element = nullptr;  // for messages
  WorldPose scope;                   // the frame that encloses it
  xml::RelativePose pose;
  std::string placement_frame;
  PlacementExtras extras;
  const ModelTemplate* model = nullptr;  // null if it is not a model
  std::size_t first_body = 0;            // of a model: its place in the world
  Element* joint = nullptr;              // null if it is not a joint
  std::string attached_to;               // of a frame or joint: what it moves with; empty: the world
  State state = State::kNew;
  WorldPose resolved;
};

class WorldReader {
 public:
  WorldReader(xml::File& file, Notices& notices, Looks* looks)
      : file_(file),
        notices_(notices),
        looks_(looks),
        source_(looks == nullptr ? ShapeSource::kCollisions : ShapeSource::kVisuals),
        sources_(meshes_, source_),
        templates_(shapes_, meshes_, source_) {}

  absl::StatusOr<WorldDescription> read();

 private:
  void collect_held(const Element& parent);
  absl::Status read_scope(Element& parent, const WorldPose& scope);
  absl::Status read_element(Element& element, const WorldPose& scope, bool in_group);
  absl::Status read_site_group(Element& site);
  absl::Status read_moving_frame(Element& frame, const WorldPose& scope);
  absl::Status find_carriers();
  absl::Status read_model(Element& model, const WorldPose& scope);
  absl::Status read_include(Element& include, const WorldPose& scope);
  absl::Status read_frame(Element& frame, const WorldPose& scope);
  absl::Status read_joint(Element& joint, const WorldPose& scope);
  absl::Status add_model(Placed placed, const ModelSource& source, std::optional<bool> is_static);
  absl::Status add(Placed placed);
  absl::StatusOr<WorldPose> frame_named(const Element& element, const std::string& name);
  absl::StatusOr<std::optional<std::size_t>> body_named(const Element& element, const std::string& name);
  absl::Status resolve(Placed& placed);
  absl::Status add_bodies(const Placed& placed);
  absl::Status add_standing_sensors(const Placed& placed);
  Eigen::Vector3d start_of(const BodyDescription& body) const;
  absl::Status add_joints(const Placed& placed);
  absl::Status add_world_joint(Placed& placed);
  void note_materials();

  xml::File& file_;
  Notices& notices_;
  Looks* const looks_;
  const ShapeSource source_;
  WorldDescription world_;
  std::string version_;
  ShapeTable shapes_;
  MeshLibrary meshes_;
  ModelSources sources_;
  ModelTemplates templates_;
  std::deque<Placed> placed_;
  std::uint64_t models_ = 0;   // placed so far
  bool lacks_models_ = false;  // an <include> was left out
  ProgramPlacer programs_;
  gazebo::Fluids fluids_;
  // The links that joints between models hold, by model.
  absl::flat_hash_map<std::string, std::set<std::string>> held_;
  absl::flat_hash_map<std::string, Placed*> by_name_;
};

// What groups models under a pose of its own.
bool holds_models(const Element& element) {
  return xml::is(element, "tessera:site") || xml::is(element, "tessera:frame");
}

absl::Status at(const Element& element, const absl::Status& status) {
  if (status.ok()) return status;
  return xml::error_at(element, status.code(), status.message());
}

constexpr char kModelItself[] = "__model__";

// "model::link" as the name of something placed, and of what is inside it or the whole.
struct ScopedName {
  explicit ScopedName(const std::string& name) : is_inner(absl::StrContains(name, "::")) {
    const std::size_t colons = name.find("::");
    base = name.substr(0, colons);
    if (is_inner) inner = name.substr(colons + 2);
  }

  std::string base;
  std::string inner = kModelItself;
  bool is_inner;
};

// `pose` in `frame`.
Pose pose_in(const WorldPose& frame, const WorldPose& pose, double sector_size) {
  const Eigen::Vector3d way =
      relative_to(pose.position, frame.position.sector, sector_size) - frame.position.local;
  const Eigen::Quaterniond back = frame.orientation.conjugate();
  return {back * way, (back * pose.orientation).normalized()};
}

// How joints of a description name the body at a place in it.
BodyId id_of(std::size_t body) { return BodyId{body + 1}; }

absl::StatusOr<WorldDescription> WorldReader::read() {
  std::unique_ptr<xml::File> converted;
  Element* root = &file_.root();
  if (xml::is(*root, "robot")) {
    absl::StatusOr<std::unique_ptr<xml::File>> sdf = urdf_to_sdf(file_, source_, notices_);
    if (!sdf.ok()) return sdf.status();
    converted = *std::move(sdf);
    root = &converted->root();
  }
  rename_root(*root, notices_);
  if (!xml::is(*root, "sdf"))
    return xml::invalid(*root, "the root element must be <sdf>, <robot> or <mujoco>");
  const absl::StatusOr<std::string> version = sdf_version(*root, notices_);
  if (!version.ok()) return version.status();
  version_ = *version;

  Element* world = root->FirstChildElement("world");
  if (world == nullptr) {
    // A file of models is a world with nothing else in it.
    world = root;
    const Element* model = root->FirstChildElement("model");
    if (model == nullptr) return xml::invalid(*root, "there is neither a <world> nor a <model>");
    if (const char* name = model->Attribute("name")) world_.name = name;
  } else {
    for (const Element* other = root->FirstChildElement(); other != nullptr;
         other = other->NextSiblingElement()) {
      if (other != world) notices_.count(absl::StrCat("<", other->Name(), "> beside the <world>, skipped"));
    }
    if (const char* name = world->Attribute("name")) world_.name = name;
    if (absl::Status status = read_world_settings(*world, world_.settings, notices_); !status.ok())
      return status;
  }
  gazebo::take_detachable_joints(*world, notices_);
  for (const Element* child = world->FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (gazebo::Fluids::is_water(*child)) templates_.measure_displacements();
  }
  collect_held(*world);
  if (absl::Status status = read_scope(*world, WorldPose{}); !status.ok()) return status;
  for (Placed& placed : placed_) {
    if (placed.joint != nullptr) continue;
    if (absl::Status status = resolve(placed); !status.ok()) return status;
    if (placed.model == nullptr) continue;
    placed.first_body = world_.bodies.size();
    if (absl::Status status = add_bodies(placed); !status.ok()) return status;
    if (absl::Status status = add_joints(placed); !status.ok()) return status;
  }
  for (Placed& placed : placed_) {
    if (placed.joint == nullptr) continue;
    if (absl::Status status = add_world_joint(placed); !status.ok()) return status;
  }
  for (const Placed& placed : placed_) {
    if (placed.model == nullptr) continue;
    if (absl::Status status = add_standing_sensors(placed); !status.ok()) return status;
  }
  if (absl::Status status = find_carriers(); !status.ok()) return status;
  if (absl::Status status = programs_.resolve(world_, notices_); !status.ok()) return status;
  world_.settings.modules = sources_.modules();
  world_.shapes = shapes_.take();
  note_materials();
  return std::move(world_);
}

// Bullet's own worlds know no more than the body.
void WorldReader::note_materials() {
  const auto has_materials = [](const Shape& shape) { return shape.parts.front().material.has_value(); };
  if (world_.settings.seams == SeamPolicy::kClone && std::ranges::any_of(world_.shapes, has_materials)) {
    notices_.count_loss(
        "shape whose collisions differ in their surface: with the seams `clone`, the first one's counts for "
        "all");
  }
}

void WorldReader::collect_held(const Element& parent) {
  for (const Element* child = parent.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (holds_models(*child)) collect_held(*child);
    if (!xml::is(*child, "joint")) continue;
    for (const char* end : {"parent", "child"}) {
      const ScopedName name(xml::child_text(*child, end));
      held_[name.base].insert(name.inner);
    }
  }
}

absl::Status WorldReader::read_scope(Element& parent, const WorldPose& scope) {
  const bool in_group = holds_models(parent);
  for (Element* child = parent.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
    if (absl::Status status = read_element(*child, scope, in_group); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status WorldReader::read_element(Element& element, const WorldPose& scope, bool in_group) {
  if (xml::is(element, "model")) return read_model(element, scope);
  if (xml::is(element, "include")) return read_include(element, scope);
  if (xml::is(element, "frame")) return read_frame(element, scope);
  if (xml::is(element, "joint")) return read_joint(element, scope);
  if (xml::is(element, "tessera:frame") && !xml::is(*element.Parent()->ToElement(), "tessera:site"))
    return read_moving_frame(element, scope);
  if (in_group) {
    return xml::invalid(element, "this element is not allowed in a <", element.Parent()->ToElement()->Name(),
                        ">");
  }
  if (xml::is(element, "tessera:site")) return read_site_group(element);
  for (absl::string_view known : {"gravity", "physics", "tessera:settings", "tessera:central_gravity"}) {
    if (!xml::is(element, known)) continue;
    const Element* first = element.Parent()->FirstChildElement(element.Name());
    if (first == &element || known == "physics") return absl::OkStatus();
    return xml::invalid(element, "the element may occur only once in a world");
  }
  if (absl::StartsWith(element.Name(), "tessera:")) {
    return xml::invalid(element, "unknown or misplaced tessera: element");
  }
  if (gazebo::Surroundings::is_one(element)) {
    if (xml::is(element, "spherical_coordinates"))
      notices_.count("<spherical_coordinates> for sensors alone: positions stay in the file's local frame");
    return programs_.surroundings.take(element);
  }
  if (gazebo::Fluids::is_one(element)) return fluids_.take(element, notices_);
  if (xml::is(element, "plugin") && gazebo::canonical_name(element) == gazebo::kTriggeredPublisher) {
    programs_.add_publisher(element, notices_);
    return absl::OkStatus();
  }
  if (xml::is(element, "plugin")) {
    if (const std::string text = gazebo::skipped(element); !text.empty()) notices_.count(text);
    return absl::OkStatus();
  }
  note_unread(element, notices_);
  return absl::OkStatus();
}

absl::Status WorldReader::read_site_group(Element& site) {
  const absl::StatusOr<std::string> name = xml::required_attribute(site, "name");
  if (!name.ok()) return name.status();
  const absl::StatusOr<WorldPose> frame = read_site(site, world_.settings.sector_size);
  if (!frame.ok()) return frame.status();
  Placed placed;
  placed.name = *name;
  placed.element = &site;
  placed.scope = *frame;
  if (absl::Status status = add(std::move(placed)); !status.ok()) return status;
  return read_scope(site, *frame);
}

absl::Status WorldReader::read_moving_frame(Element& frame, const WorldPose& scope) {
  absl::StatusOr<MovingFrame> moving =
      take_moving_frame(frame, scope.position.sector.frame, world_.settings.sector_size);
  if (!moving.ok()) return moving.status();
  std::vector<MovingFrame>& frames = world_.settings.frames;
  Placed placed;
  placed.name = moving->name;
  placed.element = &frame;
  placed.scope.position.sector.frame = static_cast<FrameNumber>(frames.size() + 1);
  frames.push_back(*std::move(moving));
  if (absl::Status status = add(placed); !status.ok()) return status;
  return read_scope(frame, placed.scope);
}

// By the names of bodies, all of which are known once all is read.
absl::Status WorldReader::find_carriers() {
  for (const Placed& placed : placed_) {
    const FrameNumber number = placed.scope.position.sector.frame;
    if (number == kWorldFrame || !xml::is(*placed.element, "tessera:frame")) continue;
    MovingFrame& frame = world_.settings.frames[number - 1];
    if (!frame.carrier) continue;
    const std::string name = placed.element->Attribute("carrier");
    const auto body = std::ranges::find(world_.bodies, name, &BodyDescription::name);
    if (body == world_.bodies.end())
      return xml::invalid(*placed.element, "carrier '", name,
                          "' is no body of the world; its form is MODEL::LINK");
    if (body->pose.position.sector.frame != frame.parent())
      return xml::invalid(
          *placed.element, "carrier '", name,
          "' must be in the same frame as this element: both in the world, or in one <tessera:frame>");
    frame.carrier->body.value = static_cast<std::uint64_t>(body - world_.bodies.begin()) + 1;
  }
  place_carried(world_);
  return absl::OkStatus();
}

absl::Status WorldReader::read_model(Element& model, const WorldPose& scope) {
  Placed placed;
  placed.element = &model;
  placed.scope = scope;
  absl::StatusOr<PlacementExtras> extras = take_extras(model);
  if (!extras.ok()) return extras.status();
  placed.extras = *extras;
  absl::StatusOr<ModelSource> source = sources_.prepare(model, version_, file_.directory());
  if (!source.ok()) return source.status();
  if (source->is_empty) {
    notices_.add(source->notices);
    lacks_models_ = true;
    return absl::OkStatus();
  }
  placed.name = source->name;
  if (source->pose) placed.pose = *source->pose;
  placed.placement_frame = source->placement_frame;
  return add_model(std::move(placed), *source, std::nullopt);
}

absl::Status WorldReader::read_include(Element& include, const WorldPose& scope) {
  Placed placed;
  placed.element = &include;
  placed.scope = scope;
  absl::StatusOr<PlacementExtras> extras = take_extras(include);
  if (!extras.ok()) return extras.status();
  placed.extras = *extras;
  const absl::StatusOr<const ModelSource*> source = sources_.included(include, file_.directory(), notices_);
  if (!source.ok()) return source.status();
  if (*source == nullptr) {
    lacks_models_ = true;
    return absl::OkStatus();
  }
  const std::string name = xml::child_text(include, "name");
  placed.name = name.empty() ? (*source)->name : name;
  const std::string placement = xml::child_text(include, "placement_frame");
  placed.placement_frame = placement.empty() ? (*source)->placement_frame : placement;
  if ((*source)->pose) placed.pose = *(*source)->pose;
  if (const Element* pose = include.FirstChildElement("pose")) {
    absl::StatusOr<xml::RelativePose> value = xml::pose_of(*pose);
    if (!value.ok()) return value.status();
    placed.pose = *std::move(value);
  }
  std::optional<bool> is_static;
  if (const Element* element = include.FirstChildElement("static")) {
    const absl::StatusOr<bool> value = xml::bool_of(*element);
    if (!value.ok()) return value.status();
    is_static = *value;
  }
  return add_model(std::move(placed), **source, is_static);
}

absl::Status WorldReader::read_frame(Element& frame, const WorldPose& scope) {
  Placed placed;
  placed.element = &frame;
  placed.scope = scope;
  const absl::StatusOr<std::string> name = xml::required_attribute(frame, "name");
  if (!name.ok()) return name.status();
  placed.name = *name;
  absl::StatusOr<PlacementExtras> extras = take_extras(frame);
  if (!extras.ok()) return extras.status();
  placed.extras = *extras;
  if (const Element* pose = frame.FirstChildElement("pose")) {
    absl::StatusOr<xml::RelativePose> value = xml::pose_of(*pose);
    if (!value.ok()) return value.status();
    placed.pose = *std::move(value);
  }
  if (const char* attached = frame.Attribute("attached_to")) placed.attached_to = attached;
  if (placed.pose.relative_to.empty()) placed.pose.relative_to = placed.attached_to;
  return add(std::move(placed));
}

absl::Status WorldReader::read_joint(Element& joint, const WorldPose& scope) {
  Placed placed;
  placed.element = &joint;
  placed.scope = scope;
  placed.joint = &joint;
  for (const char* attribute : {"name", "type"}) {
    if (absl::Status status = xml::required_attribute(joint, attribute).status(); !status.ok()) return status;
  }
  placed.name = joint.Attribute("name");
  for (const char* end : {"parent", "child"}) {
    if (xml::child_text(joint, end).empty()) return xml::invalid(joint, "<", end, "> is missing or empty");
  }
  placed.attached_to = xml::child_text(joint, "child");
  if (const Element* pose = joint.FirstChildElement("pose")) {
    absl::StatusOr<xml::RelativePose> value = xml::pose_of(*pose);
    if (!value.ok()) return value.status();
    placed.pose = *std::move(value);
  }
  if (placed.pose.relative_to.empty()) placed.pose.relative_to = placed.attached_to;
  return add(std::move(placed));
}

absl::Status WorldReader::add_model(Placed placed, const ModelSource& source, std::optional<bool> is_static) {
  absl::StatusOr<const ModelTemplate*> model = templates_.get(source.document(is_static), held_[placed.name]);
  if (!model.ok()) {
    return xml::error_at(
        *placed.element, model.status().code(),
        absl::StrCat("model '", placed.name,
                     "': ", absl::StrReplaceAll(model.status().message(), {{kAnyModel, placed.name}})));
  }
  placed.model = *model;
  notices_.add(source.notices);
  notices_.add((*model)->notices);
  return add(std::move(placed));
}

absl::Status WorldReader::add(Placed placed) {
  if (absl::StrContains(placed.name, "::") || placed.name == "world") {
    return xml::invalid(*placed.element, "the name '", placed.name, "' must not be 'world' or contain '::'");
  }
  Placed& added = placed_.emplace_back(std::move(placed));
  const auto [other, inserted] = by_name_.try_emplace(added.name, &added);
  if (inserted) return absl::OkStatus();
  return xml::invalid(*added.element, "the name '", added.name, "' must be unique, but line ",
                      other->second->element->GetLineNum(), " has it too");
}

// A frame by its name: "world", a placed element, or an element inside a model: "model::link".
absl::StatusOr<WorldPose> WorldReader::frame_named(const Element& element, const std::string& name) {
  if (name == "world") return WorldPose{};
  const ScopedName scoped(name);
  const auto found = by_name_.find(scoped.base);
  if (found == by_name_.end()) return xml::invalid(element, "there is no frame '", name, "'");
  Placed& base = *found->second;
  if (absl::Status status = resolve(base); !status.ok()) return status;
  if (scoped.inner == kModelItself) return base.resolved;
  if (base.model == nullptr || !base.model->frames.contains(scoped.inner)) {
    return xml::invalid(element, "there is no frame '", name, "'");
  }
  absl::StatusOr<WorldPose> pose =
      compose(base.resolved, base.model->frames.at(scoped.inner), world_.settings.sector_size);
  if (!pose.ok()) return at(element, pose.status());
  return pose;
}

// The body that a name in a joint stands for: a link, or what a model, frame or joint moves with. None: the
// world. UNIMPLEMENTED for what was left out.
absl::StatusOr<std::optional<std::size_t>> WorldReader::body_named(const Element& element,
                                                                   const std::string& name) {
  std::string at = name;
  for (std::size_t steps = 0; steps <= placed_.size(); ++steps) {
    if (at.empty() || at == "world") return std::nullopt;
    const ScopedName scoped(at);
    const auto found = by_name_.find(scoped.base);
    if (found == by_name_.end()) {
      if (lacks_models_) return absl::UnimplementedError("with a model that was left out");
      return xml::invalid(element, "there is no link, model, frame or joint '", at, "'");
    }
    const Placed& base = *found->second;
    if (base.model != nullptr) {
      const auto carrier = base.model->carriers.find(scoped.inner);
      if (carrier != base.model->carriers.end()) return base.first_body + carrier->second;
      if (!scoped.is_inner || base.model->frames.contains(scoped.inner))
        return absl::UnimplementedError("with a link that has no collision shape");
    }
    if (scoped.is_inner || base.model != nullptr)
      return xml::invalid(element, "there is no link, frame or joint '", at, "'");
    at = base.attached_to;
  }
  return xml::invalid(element, "'", name, "' is attached to itself, directly or through others");
}

absl::Status WorldReader::resolve(Placed& placed) {
  if (placed.state == Placed::State::kResolved) return absl::OkStatus();
  if (placed.state == Placed::State::kResolving) {
    return xml::invalid(*placed.element, "its pose is relative to itself, directly or through others");
  }
  placed.state = Placed::State::kResolving;
  WorldPose base = placed.scope;
  if (!placed.pose.relative_to.empty()) {
    absl::StatusOr<WorldPose> named = frame_named(*placed.element, placed.pose.relative_to);
    if (!named.ok()) return named.status();
    base = *named;
  }
  Pose pose = placed.pose.pose;
  if (!placed.placement_frame.empty() && placed.model != nullptr) {
    const auto frame = placed.model->frames.find(placed.placement_frame);
    if (frame == placed.model->frames.end()) {
      return xml::invalid(*placed.element, "there is no placement frame '", placed.placement_frame,
                          "' in it");
    }
    pose = pose * frame->second.inverse();
  }
  absl::StatusOr<WorldPose> resolved = compose(base, pose, world_.settings.sector_size);
  if (!resolved.ok()) return at(*placed.element, resolved.status());
  const absl::StatusOr<SectorIndex> sector = translated(resolved->position.sector, placed.extras.sector);
  if (!sector.ok()) return at(*placed.element, sector.status());
  placed.resolved = *resolved;
  placed.resolved.position.sector = *sector;
  placed.state = Placed::State::kResolved;
  return absl::OkStatus();
}

// The centre of mass of a body, m from the origin of the world, or of the frame that moves in which it is.
Eigen::Vector3d WorldReader::start_of(const BodyDescription& body) const {
  const WorldPosition& at = body.pose.position;
  const Eigen::Vector3d centre = body.pose.orientation * centre_frame(body.properties).position + at.local;
  return centre + metres_between({0, 0, 0, at.sector.frame}, at.sector, world_.settings.sector_size);
}

absl::Status WorldReader::add_bodies(const Placed& placed) {
  const Eigen::Vector3d velocity = placed.scope.orientation * placed.extras.linear_velocity;
  const Eigen::Vector3d spin = placed.scope.orientation * placed.extras.angular_velocity;
  ++models_;
  for (const FrameTemplate& frame : placed.model->link_frames) {
    world_.frames.push_back(
        {absl::StrCat(placed.name, "::", frame.name), world_.bodies.size() + frame.link, frame.pose});
  }
  for (const LinkTemplate& link : placed.model->links) {
    BodyDescription body;
    body.name = absl::StrCat(placed.name, "::", link.name);
    body.properties = link.properties;
    if (body.properties.assembly != 0) body.properties.assembly = models_;
    absl::StatusOr<WorldPose> pose = compose(placed.resolved, link.pose, world_.settings.sector_size);
    if (!pose.ok()) return at(*placed.element, pose.status());
    body.pose = *pose;
    if (link.properties.motion != Motion::kStatic) {
      const Eigen::Vector3d arm =
          placed.resolved.orientation * (link.pose * centre_frame(link.properties).position);
      body.linear_velocity = velocity + spin.cross(arm);
      body.angular_velocity = spin;
    }
    const Eigen::Vector3d start = start_of(body);
    programs_.add(link.programs, *placed.element, world_.bodies.size(), start, body);
    fluids_.surround(link.displaced, link.feels_wind, start, body, notices_);
    if (link.look) looks_->bodies.emplace(body.name, link.look);
    world_.bodies.push_back(std::move(body));
  }
  return absl::OkStatus();
}

// Bodies at the end of the world, so that the others stay where joints expect them.
absl::Status WorldReader::add_standing_sensors(const Placed& placed) {
  for (const StandingSensors& standing : placed.model->standing_sensors) {
    BodyDescription body;
    body.name = absl::StrCat(placed.name, "::", standing.body.name);
    body.properties = standing.body.properties;
    absl::StatusOr<WorldPose> pose =
        compose(placed.resolved, standing.body.pose, world_.settings.sector_size);
    if (!pose.ok()) return at(*placed.element, pose.status());
    body.pose = *pose;
    programs_.add(standing.body.programs, *placed.element, world_.bodies.size(), start_of(body), body);
    for (ProgramRecord& program : body.programs) {
      // What they ask is about the link, where it has a body. Others have no such number.
      const BodyId link = standing.link ? id_of(placed.first_body + *standing.link) : BodyId{};
      set_number(program, "body", static_cast<double>(link.value)).IgnoreError();
    }
    world_.bodies.push_back(std::move(body));
  }
  return absl::OkStatus();
}

absl::Status WorldReader::add_joints(const Placed& placed) {
  const std::size_t joints_before = world_.joints.size();
  for (const JointTemplate& from : placed.model->joints) {
    JointDescription joint{absl::StrCat(placed.name, "::", from.name), from.properties, from.drives};
    for (JointAxis& axis : joint.properties.axes) {
      if (axis.mimic.is_set()) axis.mimic.leader.value += joints_before;
    }
    joint.properties.child = id_of(placed.first_body + from.child);
    if (from.parent) {
      joint.properties.parent = id_of(placed.first_body + *from.parent);
    } else {
      const absl::StatusOr<WorldPose> pose =
          compose(placed.resolved, from.properties.in_parent, world_.settings.sector_size);
      if (!pose.ok()) return at(*placed.element, pose.status());
      joint.properties.anchor = pose->position.sector;
      joint.properties.in_parent = {pose->position.local, pose->orientation};
    }
    world_.joints.push_back(std::move(joint));
  }
  return absl::OkStatus();
}

absl::Status WorldReader::add_world_joint(Placed& placed) {
  Element& element = *placed.joint;
  const std::string type = element.Attribute("type");
  std::array<std::optional<std::size_t>, 2> bodies;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    const Element& end = *element.FirstChildElement(n == 0 ? "parent" : "child");
    const absl::StatusOr<std::optional<std::size_t>> body = body_named(end, xml::text_of(end));
    if (body.status().code() == absl::StatusCode::kUnimplemented) {
      notices_.count_joint_left_out(absl::StrCat(type, " ", body.status().message()));
      return absl::OkStatus();
    }
    if (!body.ok()) return body.status();
    bodies[n] = *body;
  }
  const auto [parent, child] = bodies;
  if (!child) return xml::invalid(*element.FirstChildElement("child"), "the child must not be the world");
  if (parent == child) return xml::invalid(element, "its parent and its child are the same body");
  const auto is_dynamic = [&](std::optional<std::size_t> body) {
    return body && world_.bodies[*body].properties.motion == Motion::kDynamic;
  };
  if (!is_dynamic(parent) && !is_dynamic(child)) {
    notices_.count("joint between links that no force moves, skipped");
    return absl::OkStatus();
  }
  if (absl::Status status = resolve(placed); !status.ok()) return status;
  const auto frame = [this](const Element& at, const std::string& name) { return frame_named(at, name); };
  absl::Status status = express_axes(element, placed.resolved.orientation, frame);
  if (!status.ok()) return status;
  const absl::StatusOr<std::optional<JointKind>> kind =
      read_world_joint(element, version_, file_.directory(), sources_, notices_);
  if (!kind.ok()) return kind.status();
  if (!kind->has_value()) return absl::OkStatus();

  JointDescription joint{placed.name, (*kind)->properties, (*kind)->drives};
  JointProperties& properties = joint.properties;
  WorldPose at = placed.resolved;
  at.orientation = at.orientation * (*kind)->axes;
  properties.child = id_of(*child);
  properties.in_child = pose_in(world_.bodies[*child].pose, at, world_.settings.sector_size);
  if (parent) {
    properties.parent = id_of(*parent);
    properties.in_parent = pose_in(world_.bodies[*parent].pose, at, world_.settings.sector_size);
  } else {
    properties.anchor = at.position.sector;
    properties.in_parent = {at.position.local, at.orientation};
  }
  if (!is_dynamic(child)) exchange_sides(properties, joint.drives);
  world_.joints.push_back(std::move(joint));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<WorldDescription> read_world(xml::File& file, Notices& notices, Looks* looks) {
  if (xml::is(file.root(), "mujoco")) return mjcf::read_mjcf(file, notices, looks);
  return WorldReader(file, notices, looks).read();
}

}  // namespace tessera
