#include "worlds/mjcf/reader.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/validate.h"
#include "worlds/loader/massless_links.h"
#include "worlds/loader/shape_table.h"
#include "worlds/mjcf/actuators.h"
#include "worlds/mjcf/contact_kinds.h"
#include "worlds/mjcf/equalities.h"
#include "worlds/mjcf/geoms.h"
#include "worlds/mjcf/joints.h"
#include "worlds/mjcf/masses.h"
#include "worlds/mjcf/model.h"
#include "worlds/mjcf/names.h"
#include "worlds/mjcf/sensors.h"
#include "worlds/mjcf/unread.h"

namespace tessera::mjcf {
namespace {

using Eigen::Vector3d;

// Where all is at the start.
struct Start {
  const mjtNum* positions = nullptr;
  const mjtNum* velocities = nullptr;
  const mjtNum* controls = nullptr;
  const mjtNum* mocap_positions = nullptr;  // null: as the model has them
  const mjtNum* mocap_rotations = nullptr;
};

class Builder {
 public:
  Builder(Model model, Notices& notices, Looks* looks)
      : model_(std::move(model)),
        notices_(notices),
        looks_(looks),
        model_name_(fit_name(model_.name, "model")),
        body_names_(model_name_),
        joint_names_(model_name_) {}

  absl::StatusOr<WorldDescription> build();

 private:
  struct Hanging {
    std::optional<std::size_t> body;  // a place in the world
    JointSide side;                   // of its frame, or of the world's
    Pose in_parent;                   // the frame of what comes next, in the model's own pose
  };

  absl::Status read_settings();
  void find_start();
  void find_carriers();
  void find_apart();
  std::vector<PlacedGeom> geoms_of(int body) const;
  absl::Status add_ground();
  absl::Status add_static(int body);
  absl::Status add_moving(int body);
  absl::Status add_body(BodyDescription body, const std::vector<PlacedGeom>& geoms, const JointSide& side);
  absl::Status add_chain(int body);
  Hanging hanging_of(int body) const;
  JointDescription joint_on(const Hanging& on, const Hop& hop);
  void add_frames();

  int carrier(int body) const { return carriers_[static_cast<std::size_t>(body)]; }
  const Pose& in_carrier(int body) const { return in_carrier_[static_cast<std::size_t>(body)]; }
  bool is_fixed(int body) const { return is_fixed_[static_cast<std::size_t>(body)]; }
  bool has_own_motion(int body) const {
    return model_->body_jntnum[body] > 0 || model_->body_mocapid[body] >= 0;
  }
  const std::string& body_name(int body) const { return names_[static_cast<std::size_t>(body)]; }

  Model model_;
  Notices& notices_;
  Looks* const looks_;
  const std::string model_name_;
  Names body_names_;
  std::vector<std::string> names_;  // by MuJoCo's body, as in the world
  Names joint_names_;
  WorldDescription world_;
  ShapeTable shapes_;
  Start start_;
  std::vector<mjtNum> zeros_;  // what a file without keyframes begins with
  // By MuJoCo's body: the body with joints that it moves with, or itself, and its pose there. Poses of bodies
  // that never move are in the world.
  std::vector<int> carriers_;
  std::vector<Pose> in_carrier_;
  std::vector<bool> is_fixed_;
  std::vector<Members> members_;  // by carrier
  Apart apart_;
  std::vector<ContactBits> bits_;  // by geom
  std::map<int, AxisDrive> drives_;
  std::map<int, JointSide> sides_;      // of carriers that move: the body frame
  std::map<int, std::size_t> bodies_;   // of carriers: the place in the world
  std::map<int, std::size_t> holders_;  // of carriers: the joint that holds it to its parent
  AxisPlaces axes_;
};

absl::Status Builder::read_settings() {
  const mjOption& option = model_->opt;
  WorldSettings& settings = world_.settings;
  if (model_.has_time_step) settings.time_step = option.timestep;
  const bool has_gravity = (option.disableflags & mjDSBL_GRAVITY) == 0;
  settings.gravity = UniformGravity{has_gravity ? vector_at(option.gravity) : Vector3d(0, 0, 0)};
  return validate(settings);
}

void Builder::find_start() {
  zeros_.assign(static_cast<std::size_t>(std::max({model_->nv, model_->nu, 1})), 0);
  start_ = {model_->qpos0, zeros_.data(), zeros_.data()};
  const auto name_of = [&](int key) { return name_at(*model_, model_->name_keyadr, key); };
  int key = model_->nkey == 1 ? 0 : -1;
  for (int n = model_->nkey - 1; n >= 0; --n) {
    if (name_of(n) == "home") key = n;
  }
  const int skipped = key < 0 ? model_->nkey : model_->nkey - 1;
  if (skipped > 0) notices_.count("<key> skipped", static_cast<std::size_t>(skipped));
  if (key < 0) return;
  start_ = {model_->key_qpos + key * model_->nq, model_->key_qvel + key * model_->nv,
            model_->key_ctrl + key * model_->nu, model_->key_mpos + 3 * key * model_->nmocap,
            model_->key_mquat + 4 * key * model_->nmocap};
  notices_.count(absl::StrCat("<key>", name_of(key).empty() ? "" : absl::StrCat(" '", name_of(key), "'"),
                              ": the world begins with it"));
}

void Builder::find_carriers() {
  const auto count = static_cast<std::size_t>(model_->nbody);
  carriers_.resize(count);
  in_carrier_.resize(count);
  is_fixed_.assign(count, true);
  members_.resize(count);
  names_.resize(count);
  for (int body = 1; body < model_->nbody; ++body) {
    const auto place = static_cast<std::size_t>(body);
    names_[place] = body_names_.unique(
        fit_name(name_at(*model_, model_->name_bodyadr, body), absl::StrCat("body_", body)));
    const int parent = model_->body_parentid[body];
    const Pose pose = pose_at(model_->body_pos, model_->body_quat, body);
    carriers_[place] = body;
    if (has_own_motion(body)) {
      is_fixed_[place] = false;
    } else if (is_fixed(parent)) {
      in_carrier_[place] = in_carrier(parent) * pose;
    } else {
      is_fixed_[place] = false;
      carriers_[place] = carrier(parent);
      in_carrier_[place] = in_carrier(parent) * pose;
    }
    const Pose in_own = is_fixed(body) ? Pose{} : in_carrier(body);
    members_[static_cast<std::size_t>(carrier(body))].emplace_back(body, in_own);
  }
}

// What does not collide: bodies that the file excludes, and those that joints connect, where no joint of
// ours does so directly and leaves them apart. In MuJoCo, bodies collide with what never moves, even if
// joints connect them.
void Builder::find_apart() {
  const bool filters_parents = (model_->opt.disableflags & mjDSBL_FILTERPARENT) == 0;
  for (int body = 1; body < model_->nbody; ++body) {
    const int parent = model_->body_parentid[body];
    const bool is_link = carrier(body) == body && !is_fixed(body) && !is_fixed(parent);
    if (is_link && filters_parents && hops_of(*model_, body).size() > 1)
      apart_.insert(std::minmax(carrier(parent), body));
  }
  for (int n = 0; n < model_->nexclude; ++n) {
    const int signature = model_->exclude_signature[n];
    const int first = carrier((signature >> 16) - 1);
    const int second = carrier((signature & 0xffff) - 1);
    const auto joined = [&](int parent, int child) {
      return !is_fixed(parent) && !is_fixed(child) && hops_of(*model_, child).size() == 1 &&
             carrier(model_->body_parentid[child]) == parent;
    };
    const bool is_known = filters_parents && (joined(first, second) || joined(second, first));
    if (first != second && !is_known) apart_.insert(std::minmax(first, second));
  }
}

std::vector<PlacedGeom> Builder::geoms_of(int body) const {
  std::vector<PlacedGeom> result;
  for (const auto& [member, pose] : members_[static_cast<std::size_t>(body)]) {
    const int first = model_->body_geomadr[member];
    for (int geom = first; geom < first + model_->body_geomnum[member]; ++geom)
      result.push_back({geom, pose * pose_at(model_->geom_pos, model_->geom_quat, geom)});
  }
  return result;
}

absl::Status Builder::add_body(BodyDescription body, const std::vector<PlacedGeom>& geoms,
                               const JointSide& side) {
  absl::StatusOr<WorldPose> pose = compose(WorldPose{}, side.pose, world_.settings.sector_size);
  if (!pose.ok())
    return absl::Status(pose.status().code(), absl::StrCat(body.name, ": ", pose.status().message()));
  body.pose = *pose;
  if (looks_ != nullptr) {
    Look look = look_of(model_, geoms);
    if (!look.shape.parts.empty())
      looks_->bodies.emplace(body.name, std::make_shared<const Look>(std::move(look)));
  }
  if (body.properties.motion != Motion::kStatic) {
    const Vector3d arm = side.pose.orientation * centre_frame(body.properties).position;
    body.linear_velocity = side.linear_velocity + side.angular_velocity.cross(arm);
    body.angular_velocity = side.angular_velocity;
  }
  world_.bodies.push_back(std::move(body));
  return absl::OkStatus();
}

// A body for each geom of the world.
absl::Status Builder::add_ground() {
  for (int geom = model_->body_geomadr[0];
       geom >= 0 && geom < model_->body_geomadr[0] + model_->body_geomnum[0]; ++geom) {
    BodyDescription body;
    body.properties.motion = Motion::kStatic;
    body.name = body_names_.unique(
        fit_name(name_at(*model_, model_->name_geomadr, geom), absl::StrCat("world_geom_", geom)));
    const std::vector<PlacedGeom> own = {{geom, Pose{}}};
    if (!set_shape(model_, bits_, own, shapes_, body.properties, notices_)) {
      notices_.count("geom of the world that collides with nothing, skipped");
      continue;
    }
    const Pose pose = pose_at(model_->geom_pos, model_->geom_quat, geom);
    if (absl::Status status = add_body(std::move(body), own, {pose}); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status Builder::add_static(int body) {
  BodyDescription description;
  description.properties.motion = Motion::kStatic;
  description.name = body_name(body);
  const std::vector<PlacedGeom> geoms = geoms_of(body);
  set_shape(model_, bits_, geoms, shapes_, description.properties, notices_);
  bodies_[body] = world_.bodies.size();
  return add_body(std::move(description), geoms, {in_carrier(body)});
}

absl::Status Builder::add_moving(int body) {
  const int mocap = model_->body_mocapid[body];
  if (mocap < 0 && model_->jnt_type[model_->body_jntadr[body]] != mjJNT_FREE) return add_chain(body);
  BodyDescription description;
  description.name = body_name(body);
  JointSide side;
  if (mocap >= 0) {
    description.properties.motion = Motion::kKinematic;
    side.pose = start_.mocap_positions == nullptr
                    ? pose_at(model_->body_pos, model_->body_quat, body)
                    : pose_at(start_.mocap_positions, start_.mocap_rotations, mocap);
  } else {
    const int joint = model_->body_jntadr[body];
    const mjtNum* const at = start_.positions + model_->jnt_qposadr[joint];
    const mjtNum* const velocity = start_.velocities + model_->jnt_dofadr[joint];
    side.pose = {vector_at(at), quaternion_at(at + 3)};
    side.linear_velocity = vector_at(velocity);
    side.angular_velocity = side.pose.orientation * vector_at(velocity + 3);
    note_free_joint(*model_, joint, notices_);
  }
  const std::vector<PlacedGeom> geoms = geoms_of(body);
  if (!set_shape(model_, bits_, geoms, shapes_, description.properties, notices_))
    notices_.count("body without a geom that collides, collides with nothing");
  set_mass(model_, members_[static_cast<std::size_t>(body)], 1, description.properties, notices_);
  sides_[body] = side;
  bodies_[body] = world_.bodies.size();
  return add_body(std::move(description), geoms, side);
}

// What the next joint of a body hangs on: without a body of ours, the world.
Builder::Hanging Builder::hanging_of(int body) const {
  const int parent = model_->body_parentid[body];
  Hanging result;
  result.in_parent = in_carrier(parent) * pose_at(model_->body_pos, model_->body_quat, body);
  const auto on = bodies_.find(carrier(parent));
  if (on != bodies_.end()) result.body = on->second;
  if (!is_fixed(parent)) {
    result.side = sides_.at(carrier(parent));
  } else if (result.body) {
    result.side.pose = in_carrier(parent);
    result.in_parent = in_carrier(parent).inverse() * result.in_parent;
  }
  return result;
}

JointDescription Builder::joint_on(const Hanging& on, const Hop& hop) {
  JointDescription joint;
  joint.properties = joint_of(*model_, hop, notices_);
  JointProperties& properties = joint.properties;
  properties.in_parent = on.in_parent * properties.in_parent;
  std::string name;
  for (std::size_t axis = 0; axis < hop.joints.size(); ++axis) {
    const int from = hop.joints[axis];
    if (const auto drive = drives_.find(from); drive != drives_.end()) {
      joint.drives[axis] = drive->second.drive;
      properties.axes[axis].effort_max = drive->second.effort_max;
    }
    axes_[from] = {world_.joints.size(), axis};
    absl::StrAppend(&name, name.empty() ? "" : "_",
                    fit_name(name_at(*model_, model_->name_jntadr, from), absl::StrCat("joint_", from)));
  }
  joint.name = joint_names_.unique(name);
  properties.child = BodyId{world_.bodies.size() + 1};
  if (on.body) properties.parent = BodyId{*on.body + 1};
  return joint;
}

// A body with joints, and the links between them.
absl::Status Builder::add_chain(int body) {
  const std::vector<Hop> hops = hops_of(*model_, body);
  const Members& members = members_[static_cast<std::size_t>(body)];
  const double shared = kLeastMassShare * static_cast<double>(hops.size() - 1);
  const bool hits_parent =
      is_fixed(model_->body_parentid[body]) || (model_->opt.disableflags & mjDSBL_FILTERPARENT) != 0;
  Hanging on = hanging_of(body);
  for (std::size_t n = 0; n < hops.size(); ++n) {
    const bool is_last = n + 1 == hops.size();
    JointDescription joint = joint_on(on, hops[n]);
    joint.properties.bodies_collide = hits_parent && hops.size() == 1;
    on.side = placed_child(joint.properties, on.side,
                           place_of(*model_, hops[n], start_.positions, start_.velocities));
    on.in_parent = Pose{};
    on.body = world_.bodies.size();
    if (absl::Status status = anchor(joint.properties, world_.settings.sector_size); !status.ok())
      return status;
    BodyDescription link;
    const std::vector<PlacedGeom> geoms = is_last ? geoms_of(body) : std::vector<PlacedGeom>{};
    const bool collides = set_shape(model_, bits_, geoms, shapes_, link.properties, notices_);
    if (!is_last) {
      link.name =
          body_names_.unique(absl::StrCat(body_name(body).substr(model_name_.size() + 2), "_link_", n + 1));
      notices_.count("link between several joints of a body, with a hundredth of its mass");
    } else {
      link.name = body_name(body);
      if (!collides) notices_.count("body without a geom that collides, collides with nothing");
    }
    set_mass(model_, members, is_last ? 1 - shared : kLeastMassShare, link.properties, notices_);
    world_.joints.push_back(std::move(joint));
    if (absl::Status status = add_body(std::move(link), geoms, on.side); !status.ok()) return status;
  }
  sides_[body] = on.side;
  bodies_[body] = *on.body;
  holders_[body] = world_.joints.size();
  return absl::OkStatus();
}

// Sites, and bodies that are part of others.
void Builder::add_frames() {
  const auto add = [&](std::string name, int body, const Pose& pose) {
    const auto on = bodies_.find(carrier(body));
    if (on == bodies_.end()) {
      notices_.count("site of the world itself, skipped");
      return;
    }
    const Pose in_own = is_fixed(body) ? Pose{} : in_carrier(body);
    world_.frames.push_back({std::move(name), on->second, in_own * pose});
  };
  for (int body = 1; body < model_->nbody; ++body) {
    if (carrier(body) != body) add(body_name(body), body, Pose{});
  }
  for (int site = 0; site < model_->nsite; ++site) {
    const std::string name = name_at(*model_, model_->name_siteadr, site);
    if (name.empty()) continue;
    add(body_names_.unique(fit_name(name, absl::StrCat("site_", site))), model_->site_bodyid[site],
        pose_at(model_->site_pos, model_->site_quat, site));
  }
}

absl::StatusOr<WorldDescription> Builder::build() {
  world_.name = model_name_;
  if (absl::Status status = read_settings(); !status.ok()) return status;
  find_start();
  find_carriers();
  find_apart();
  bits_ = contact_bits(*model_, carriers_, apart_, notices_);
  drives_ = drives_of(model_, start_.controls, notices_);
  if (absl::Status status = add_ground(); !status.ok()) return status;
  for (int body = 1; body < model_->nbody; ++body) {
    if (carrier(body) != body) continue;
    absl::Status status = is_fixed(body) ? add_static(body) : add_moving(body);
    if (!status.ok()) return status;
  }
  add_frames();
  SensorBodies places;
  for (int body = 0; body < model_->nbody; ++body) {
    const auto on = bodies_.find(carrier(body));
    const bool moves = !is_fixed(body);
    places.moves.push_back(moves);
    Place& place = places.places.emplace_back();
    if (on != bodies_.end()) place.body = on->second;
    place.pose = in_carrier(body);
    if (const auto holder = holders_.find(carrier(body)); holder != holders_.end())
      place.joint = holder->second;
  }
  add_equalities(*model_, places, axes_, joint_names_, world_, notices_);
  add_sensors(model_, places, world_, notices_);
  note_unread(*model_, notices_);
  world_.shapes = shapes_.take();
  if (world_.bodies.empty())
    return absl::InvalidArgumentError("there is no body in it, nor a geom of the world");
  return std::move(world_);
}

}  // namespace

absl::StatusOr<WorldDescription> read_mjcf(xml::File& file, Notices& notices, Looks* looks) {
  absl::StatusOr<Model> model = compile(file, notices);
  if (!model.ok()) return model.status();
  absl::StatusOr<WorldDescription> world = Builder(*std::move(model), notices, looks).build();
  if (world.ok()) return world;
  return absl::Status(world.status().code(), absl::StrCat(file.name(), ": ", world.status().message()));
}

}  // namespace tessera::mjcf
