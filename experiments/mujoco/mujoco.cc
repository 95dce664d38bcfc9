#include "experiments/mujoco/mujoco.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>
#include <variant>

#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

struct Delete {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

// A world as MuJoCo has compiled it: what never changes.
struct Model {
  // Of an axis, among all joints; negative: none.
  struct Place {
    int freedom = -1;
    int servo = -1;
  };

  Place place(BodyId child, int axis = 0) const {
    Place found;
    const int joint = mj_name2id(its.get(), mjOBJ_JOINT, mjcf_joint(child, axis).c_str());
    if (joint >= 0) found.freedom = its->jnt_dofadr[joint];
    found.servo = mj_name2id(its.get(), mjOBJ_ACTUATOR, mjcf_servo(child, axis).c_str());
    return found;
  }

  WorldDescription world;
  std::vector<BodyRecord> records;  // relative to the anchor
  int steps = 1;                    // in a tick
  std::unique_ptr<mjModel, Delete> its;
  std::vector<std::array<Place, 2>> axes;  // by joint
  std::vector<int> bodies;                 // by body
};

class Mujoco : public LocalWorld {
 public:
  explicit Mujoco(std::shared_ptr<const Model> model)
      : model_(std::move(model)), data_(mj_makeData(model_->its.get())) {
    mj_forward(model_->its.get(), data_.get());
    for (std::size_t n = 0; n < model_->world.bodies.size(); ++n) set_velocity(n);
    for (std::size_t n = 0; n < model_->world.joints.size(); ++n)
      set_drives(n, model_->world.joints[n].drives);
  }

  using LocalWorld::step;
  void step(std::span<const Command> commands) override {
    for (const Command& command : commands) {
      if (const auto* set = std::get_if<SetDrives>(&command)) set_drives(set->id.value - 1, set->drives);
    }
    warned_ = warnings();
    for (int n = 0; n < model_->steps; ++n) mj_step(model_->its.get(), data_.get());
  }

  // Where a number was none, or huge: MuJoCo warns, and starts anew.
  std::size_t diverged() const override { return warnings() - warned_; }

  std::vector<BodyRecord> bodies() const override {
    mj_kinematics(model_->its.get(), data_.get());
    mj_comPos(model_->its.get(), data_.get());
    mj_comVel(model_->its.get(), data_.get());
    std::vector<BodyRecord> records;
    for (std::size_t n = 0; n < model_->records.size(); ++n) {
      BodyRecord record = model_->records[n];
      if (record.properties.motion != Motion::kDynamic) continue;
      const int body = model_->bodies[n];
      const mjtNum* q = data_->xquat + 4 * body;
      const Pose centre = Pose{Vector3d(data_->xpos + 3 * body), Eigen::Quaterniond(q[0], q[1], q[2], q[3])} *
                          centre_frame(record.properties);
      Eigen::Map<Vector3d>(record.state.position.data()) = centre.position;
      record.state.rotation = rotation_of(centre.orientation);
      std::array<mjtNum, 6> velocity{};  // spin, then that of the centre of mass
      mj_objectVelocity(model_->its.get(), data_.get(), mjOBJ_BODY, body, velocity.data(), 0);
      std::copy_n(velocity.begin() + 3, 3, record.state.linear_velocity.begin());
      std::copy_n(velocity.begin(), 3, record.state.angular_velocity.begin());
      records.push_back(record);
    }
    return records;
  }

 private:
  std::size_t warnings() const {
    std::size_t sum = 0;
    for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC})
      sum += static_cast<std::size_t>(data_->warning[warning].number);
    return sum;
  }

  // That of the description, against what the body hangs on.
  void set_velocity(std::size_t n) {
    const BodyDescription& body = model_->world.bodies[n];
    const auto joint = std::ranges::find_if(model_->world.joints, [&](const JointDescription& other) {
      return other.properties.child == BodyId{n + 1};
    });
    if (joint == model_->world.joints.end()) {
      const int freedom = model_->place(BodyId{n + 1}).freedom;
      if (freedom < 0) return;
      const Vector3d spin = body.pose.orientation.conjugate() * body.angular_velocity;
      Eigen::Map<Vector3d>(data_->qvel + freedom) = body.linear_velocity;
      Eigen::Map<Vector3d>(data_->qvel + freedom + 3) = spin;
      return;
    }
    const JointProperties& properties = joint->properties;
    Vector3d linear = body.linear_velocity, angular = body.angular_velocity;
    if (properties.parent != BodyId{}) {
      const BodyDescription& parent = model_->world.bodies[properties.parent.value - 1];
      linear -= parent.linear_velocity;
      angular -= parent.angular_velocity;
    }
    // Axes are perpendicular at the start, where joints are at their zero.
    const Eigen::Quaterniond frame = body.pose.orientation * properties.in_child.orientation;
    for (int axis = 0; axis < axis_count(properties.type); ++axis) {
      const Vector3d& motion = properties.type == JointType::kPrismatic ? linear : angular;
      const int freedom = model_->axes[joint - model_->world.joints.begin()][axis].freedom;
      data_->qvel[freedom] = (frame * Vector3d::Unit(axis)).dot(motion);
    }
  }

  void set_drives(std::size_t joint, const JointDrives& drives) {
    for (std::size_t axis = 0; axis < drives.size(); ++axis) {
      const Model::Place& place = model_->axes[joint][axis];
      if (place.servo >= 0 && drives[axis].mode == DriveMode::kServo)
        data_->ctrl[place.servo] = drives[axis].target;
      if (place.freedom >= 0 && drives[axis].mode == DriveMode::kEffort)
        data_->qfrc_applied[place.freedom] = drives[axis].target;
    }
  }

  std::shared_ptr<const Model> model_;
  std::unique_ptr<mjData, Delete> data_;
  std::size_t warned_ = 0;  // before the last tick
};

absl::StatusOr<std::unique_ptr<mjModel, Delete>> compiled(const std::string& text) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  constexpr char kName[] = "world.xml";
  if (mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(text.size())) != 0)
    return absl::InternalError("MuJoCo takes no file");
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], text.data(), text.size());
  std::array<char, 1000> error{};
  std::unique_ptr<mjModel, Delete> model(mj_loadXML(kName, files.get(), error.data(), error.size()));
  mj_deleteVFS(files.get());
  if (!model) return absl::InternalError(absl::StrCat("MuJoCo: ", error.data()));
  return model;
}

absl::StatusOr<std::shared_ptr<const Model>> model_of(const WorldDescription& world,
                                                      const MujocoOptions& options) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  const absl::StatusOr<std::string> text = mjcf_of(world, options);
  if (!text.ok()) return text.status();
  absl::StatusOr<std::unique_ptr<mjModel, Delete>> made = compiled(*text);
  if (!made.ok()) return made.status();
  const auto model = std::make_shared<Model>();
  model->world = world;
  model->records = *std::move(records);
  model->steps = options.steps;
  model->its = *std::move(made);
  for (BodyRecord& record : model->records) {
    Eigen::Map<Vector3d>(record.state.position.data()) +=
        metres_between(world.anchor, record.home, world.settings.sector_size);
    record.home = world.anchor;
    model->bodies.push_back(mj_name2id(model->its.get(), mjOBJ_BODY, mjcf_body(record.id).c_str()));
  }
  for (const JointDescription& joint : world.joints) {
    const BodyId child = joint.properties.child;
    model->axes.push_back({model->place(child, 0), model->place(child, 1)});
  }
  return model;
}

}  // namespace

bool has_mujoco() { return true; }

absl::StatusOr<std::unique_ptr<LocalWorld>> in_mujoco(const WorldDescription& world) {
  absl::StatusOr<std::vector<std::unique_ptr<LocalWorld>>> made = alike_in_mujoco(world, {}, 1);
  if (!made.ok()) return made.status();
  return std::move(made->front());
}

absl::StatusOr<std::vector<std::unique_ptr<LocalWorld>>> alike_in_mujoco(const WorldDescription& world,
                                                                         const MujocoOptions& options,
                                                                         int count) {
  mju_user_warning = [](const char*) {};  // diverged() tells; else it writes a file
  const absl::StatusOr<std::shared_ptr<const Model>> model = model_of(world, options);
  if (!model.ok()) return model.status();
  std::vector<std::unique_ptr<LocalWorld>> worlds;
  for (int n = 0; n < count; ++n) worlds.push_back(std::make_unique<Mujoco>(*model));
  return worlds;
}

}  // namespace tessera
