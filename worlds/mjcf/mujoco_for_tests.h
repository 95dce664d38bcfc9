// What MuJoCo says of a file, to compare with.
#pragma once

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <string>

#include "lpss/model/limits.h"
#include "worlds/loader/world_text_for_tests.h"
#include "worlds/mjcf/contact_kinds.h"
#include "worlds/mjcf/joints.h"
#include "worlds/mjcf/model.h"
#include "worlds/mjcf/names.h"
#include "worlds/mjcf/reader.h"

namespace tessera::mjcf {

struct DeleteData {
  void operator()(mjData* data) const { mj_deleteData(data); }
};

// A file, read by MuJoCo and by us.
struct Both {
  Both(const std::string& text, const std::filesystem::path& folder) {
    auto own = xml::File::parse(text, "<string>", folder);
    EXPECT_TRUE(own.ok()) << own.status();
    if (!own.ok()) return;
    auto read = compile(**own, notices);
    EXPECT_TRUE(read.ok()) << read.status();
    if (!read.ok()) return;
    model = std::make_unique<Model>(*std::move(read));
    data.reset(mj_makeData(model->its.get()));
    const mjModel& its = **model;
    int key = its.nkey == 1 ? 0 : -1;
    for (int n = its.nkey - 1; n >= 0; --n) {
      if (std::string(its.names + its.name_keyadr[n]) == "home") key = n;
    }
    if (key >= 0) mj_resetDataKeyframe(&its, data.get(), key);
    mj_kinematics(&its, data.get());
    mj_comPos(&its, data.get());
    mj_comVel(&its, data.get());
    loaded = load(text, folder);
    for (const BodyDescription& body : loaded.world.bodies) bodies[body.name] = &body;
  }

  // Of a body of MuJoCo that is one of ours, by its name; null if it is a part of another one.
  const BodyDescription* body(int n) const {
    const std::string name =
        fit_name(name_at(**model, (*model)->name_bodyadr, n), "body_" + std::to_string(n));
    const auto found = bodies.find(fit_name(model->name, "model") + "::" + name);
    return found == bodies.end() ? nullptr : found->second;
  }

  Notices notices;
  std::unique_ptr<Model> model;
  std::unique_ptr<mjData, DeleteData> data;
  LoadedWorld loaded;
  std::map<std::string, const BodyDescription*> bodies;
};

inline Pose pose_in_world(const Both& both, const BodyDescription& body) {
  return {relative_to(body.pose.position, {}, both.loaded.world.settings.sector_size), body.pose.orientation};
}

// Every body stands where MuJoCo has it, and moves so.
inline void expect_same_motion(const Both& both) {
  const mjModel& model = **both.model;
  for (int n = 1; n < model.nbody; ++n) {
    const BodyDescription* const body = both.body(n);
    const bool has_joints = model.body_jntnum[n] > 0;
    if (body == nullptr || (!has_joints && body->properties.motion == Motion::kDynamic)) continue;
    const Pose pose = pose_in_world(both, *body);
    const double size = 1 + pose.position.norm();
    expect_near(pose.position, vector_at(both.data->xpos + 3 * n), 1e-9 * size);
    EXPECT_LT(pose.orientation.angularDistance(quaternion_at(both.data->xquat + 4 * n)), 1e-7) << body->name;
    if (body->properties.motion != Motion::kDynamic) continue;
    const bool has_ball =
        std::any_of(model.jnt_type, model.jnt_type + model.njnt, [](int type) { return type == mjJNT_BALL; });
    if (has_ball) continue;  // whose rate we do not set
    mjtNum velocity[6];
    mj_objectVelocity(&model, both.data.get(), mjOBJ_XBODY, n, velocity, 0);
    expect_near(body->angular_velocity, vector_at(velocity), 1e-7 * (1 + vector_at(velocity).norm()));
    const Eigen::Vector3d arm = pose.orientation * centre_frame(body->properties).position;
    const Eigen::Vector3d linear = vector_at(velocity + 3) + vector_at(velocity).cross(arm);
    expect_near(body->linear_velocity, linear, 1e-7 * (1 + linear.norm()));
  }
}

// What moves weighs as much together. In MuJoCo's own pose, so does it along all axes.
inline void expect_same_masses(const Both& both) {
  const mjModel& model = **both.model;
  double mass = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
  const auto add = [&](double sign, double m, const Pose& centre, const Eigen::Vector3d& moments) {
    const Eigen::Matrix3d axes = centre.orientation.toRotationMatrix();
    const Eigen::Vector3d& arm = centre.position;
    mass += sign * m;
    moment += sign * m * arm;
    tensor += sign * (axes * moments.asDiagonal() * axes.transpose());
    tensor += sign * m * (arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  };
  double all = 0;
  for (int n = 1; n < model.nbody; ++n) {
    if (model.body_weldid[n] == 0) continue;
    all += model.body_mass[n];
    Eigen::Matrix3d axes =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(both.data->ximat + 9 * n);
    add(1, model.body_mass[n], {vector_at(both.data->xipos + 3 * n), Eigen::Quaterniond(axes)},
        vector_at(model.body_inertia + 3 * n));
  }
  const Eigen::Matrix3d theirs = tensor;
  for (const BodyDescription& body : both.loaded.world.bodies) {
    if (body.properties.motion != Motion::kDynamic) continue;
    add(-1, body.properties.mass, pose_in_world(both, body) * centre_frame(body.properties),
        Eigen::Vector3d(body.properties.inertia.data()));
  }
  EXPECT_NEAR(mass, 0, 1e-9 * all + kMassMin * static_cast<double>(both.loaded.repairs.size() * model.nbody));
  if (model.nkey > 0) return;  // links between joints of a body are elsewhere then
  EXPECT_LE(moment.norm(), 1e-7 * (all + theirs.norm()));
  EXPECT_LE(tensor.norm(), 1e-7 * (all + theirs.norm()));
}

// Each hinge and slide has MuJoCo's position and range.
inline void expect_same_joints(const Both& both) {
  const mjModel& model = **both.model;
  std::map<std::string, const JointDescription*> joints;
  for (const JointDescription& joint : both.loaded.world.joints) joints[joint.name] = &joint;
  for (int body = 1; body < model.nbody; ++body) {
    if (model.body_jntnum[body] == 0 || model.jnt_type[model.body_jntadr[body]] == mjJNT_FREE) continue;
    for (const Hop& hop : hops_of(model, body)) {
      std::string name;
      for (const int joint : hop.joints) {
        name += name.empty() ? "" : "_";
        name += fit_name(name_at(model, model.name_jntadr, joint), "joint_" + std::to_string(joint));
      }
      const auto found = joints.find(fit_name(both.model->name, "model") + "::" + name);
      ASSERT_NE(found, joints.end()) << name;
      const JointProperties& own = found->second->properties;
      if (own.type == JointType::kBall) continue;
      Pose parent;
      if (own.parent != BodyId{})
        parent = pose_in_world(both, both.loaded.world.bodies[own.parent.value - 1]);
      else
        parent.position = metres_between({}, own.anchor, both.loaded.world.settings.sector_size);
      const Pose child = pose_in_world(both, both.loaded.world.bodies[own.child.value - 1]);
      const auto position = joint_position(own.type, parent * own.in_parent, child * own.in_child);
      for (std::size_t axis = 0; axis < hop.joints.size(); ++axis) {
        const int joint = hop.joints[axis];
        const bool is_angle = model.jnt_type[joint] == mjJNT_HINGE;
        const double theirs = both.data->qpos[model.jnt_qposadr[joint]];
        const double apart = position[axis] - theirs;
        const double difference = is_angle ? std::remainder(apart, 2 * std::numbers::pi) : apart;
        EXPECT_NEAR(difference, 0, 1e-7 * (1 + std::abs(theirs))) << name << " axis " << axis;
        const bool is_limited = model.jnt_limited[joint] != 0 && !own.axes[axis].mimic.is_set() &&
                                (model.opt.disableflags & (mjDSBL_LIMIT | mjDSBL_CONSTRAINT)) == 0;
        const mjtNum* const range = model.jnt_range + 2 * joint;
        const bool fits = !is_angle || (range[0] >= -std::numbers::pi && range[1] <= std::numbers::pi);
        if (is_limited && fits && own.axes[axis].lower < own.axes[axis].upper) {
          EXPECT_DOUBLE_EQ(own.axes[axis].lower, range[0]) << name;
          EXPECT_DOUBLE_EQ(own.axes[axis].upper, range[1]) << name;
        }
      }
    }
  }
}

}  // namespace tessera::mjcf
