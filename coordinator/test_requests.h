// Commands and queries of clients, in few words.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "proto/convert.h"
#include "tessera.pb.h"

namespace tessera {

inline v1::Vector3 xyz(double x, double y, double z) { return to_proto(Eigen::Vector3d(x, y, z)); }

inline v1::Request request_of(const std::vector<v1::Command>& commands, std::uint64_t ticks = 0,
                              const std::vector<v1::Query>& queries = {}) {
  v1::Request request;
  request.mutable_commands()->Add(commands.begin(), commands.end());
  request.set_ticks(ticks);
  request.mutable_queries()->Add(queries.begin(), queries.end());
  return request;
}

inline v1::Command spawn_of(const v1::Model& model, const std::string& prefix = "") {
  v1::Command command;
  *command.mutable_spawn()->mutable_model() = model;
  command.mutable_spawn()->set_prefix(prefix);
  return command;
}

// Bodies, joints and frames of a description.
inline v1::Model model_of(const WorldDescription& description) {
  const v1::World world = to_proto(description);
  v1::Model model;
  *model.mutable_shapes() = world.shapes();
  *model.mutable_bodies() = world.bodies();
  *model.mutable_joints() = world.joints();
  *model.mutable_frames() = world.frames();
  return model;
}

// A dynamic ball at the origin; a name is generated where it has none.
inline v1::Command spawn(const std::string& name, double radius = 0.5) {
  BodyDescription body;
  body.name = name;
  v1::Model model;
  *model.add_bodies() = to_proto(body);
  *model.add_shapes() = to_proto(Shape{{{Sphere{radius}, {}}}});
  return spawn_of(model);
}

inline v1::Command removal(const std::string& body) {
  v1::Command command;
  command.mutable_remove()->mutable_body()->set_name(body);
  return command;
}

inline v1::Command removal_of_all(const std::string& prefix) {
  v1::Command command;
  command.mutable_remove()->set_prefix(prefix);
  return command;
}

inline v1::Command velocity(std::uint64_t body, double x) {
  v1::Command command;
  command.mutable_set_velocity()->mutable_body()->set_id(body);
  *command.mutable_set_velocity()->mutable_linear() = xyz(x, 0, 0);
  return command;
}

inline v1::Command push(const std::string& body, double z = 1) {
  v1::Command command;
  command.mutable_apply_impulse()->mutable_body()->set_name(body);
  *command.mutable_apply_impulse()->mutable_impulse() = xyz(0, 0, z);
  return command;
}

inline v1::Command teleport(const std::string& body, const WorldPose& pose) {
  v1::Command command;
  command.mutable_teleport()->mutable_body()->set_name(body);
  *command.mutable_teleport()->mutable_pose() = to_proto(pose);
  return command;
}

// Without a parent: to the world.
inline v1::Command hinge(const std::string& name, const std::string& parent, const std::string& child) {
  v1::Command command;
  v1::AddJoint& addition = *command.mutable_add_joint();
  addition.mutable_joint()->set_name(name);
  addition.mutable_joint()->mutable_properties()->set_type(v1::JOINT_REVOLUTE);
  if (!parent.empty()) addition.mutable_parent()->set_name(parent);
  if (!child.empty()) addition.mutable_child()->set_name(child);
  return command;
}

inline v1::Command removal_of_joint(const std::string& name) {
  v1::Command command;
  command.mutable_remove_joint()->mutable_joint()->set_name(name);
  return command;
}

inline v1::Command drive(const std::string& joint, std::uint32_t axis, v1::JointDrive::Mode mode,
                         double target) {
  v1::Command command;
  command.mutable_set_joint_drives()->mutable_joint()->set_name(joint);
  v1::AxisDrive& given = *command.mutable_set_joint_drives()->add_drives();
  given.set_axis(axis);
  given.mutable_drive()->set_mode(mode);
  given.mutable_drive()->set_target(target);
  return command;
}

// Of joints by ids, to positions along their first axes.
inline v1::Command drive_columns(const std::vector<std::uint64_t>& joints,
                                 const std::vector<double>& targets) {
  v1::Command command;
  v1::DriveJoints& columns = *command.mutable_drive_joints();
  columns.mutable_joints()->Add(joints.begin(), joints.end());
  columns.set_axis(1);
  columns.set_mode(v1::JointDrive::POSITION);
  columns.mutable_targets()->Add(targets.begin(), targets.end());
  return command;
}

inline v1::Query hash_query() {
  v1::Query query;
  query.mutable_hash();
  return query;
}

}  // namespace tessera
