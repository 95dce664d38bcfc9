// Commands and queries of every kind there is, with fields at random: kinds and fields are found by
// protobuf's reflection, so that new ones are drawn without a line here.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <string>

#include "simulator/any_number.h"
#include "simulator/any_program.h"
#include "simulator/dice.h"
#include "simulator/known_world.h"
#include "tessera.pb.h"

namespace tessera {

class AnyMessage {
 public:
  // Draws for a world that is known so. With `is_valid`, most of what is drawn is accepted; without, some
  // fields are out of bounds, name nothing, or contradict each other.
  AnyMessage(Dice& dice, const KnownWorld& world, bool is_valid)
      : dice_(dice), world_(world), is_valid_(is_valid), numbers_(dice, is_valid) {}

  v1::Command command();
  v1::Query query();

 private:
  using Message = google::protobuf::Message;
  using Field = google::protobuf::FieldDescriptor;
  using Oneof = google::protobuf::OneofDescriptor;

  // By reflection, any_message.cc.
  void fill_any_kind(Message& message);
  void fill(Message& message);
  void fill_field(Message& message, const Field& field);
  void fill_one_of(Message& message, const Oneof& oneof);
  void fill_element(Message& message, const Field& field);
  void fill_scalar(Message& message, const Field& field);
  // Whether it is a message that reflection alone would not make valid.
  bool fill_special(Message& message, const Field* as);
  NumberRange range_of(const Field& field) const;
  std::uint64_t integer_of(const Field& field);
  std::string text_of(const Field& field);

  // any_model.cc
  void fill_model(v1::Model& model);
  void fill_body(v1::Body& body, v1::Model& model, double apart);
  void fill_properties(v1::BodyProperties& properties);
  AnyProgram any_program();
  void fill_tell(v1::TellProgram& command);
  void fill_shape(v1::Shape& shape, bool is_static);
  void fill_geometry(v1::Geometry& geometry, bool is_static);
  void fill_hull(v1::Geometry::ConvexHull& hull);
  void fill_mesh(v1::Geometry::TriangleMesh& mesh);
  void fill_heights(v1::Geometry::HeightField& heights);
  void fill_ground(v1::Geometry::Ground& ground);
  void fill_joint(v1::Joint& joint);
  void fill_drives(v1::SetJointDrives& command);
  void fill_drives(v1::DriveJoints& command);
  void fill_state(v1::SetState& command);
  void fill_removal(v1::Remove& command);
  void fill_drive(v1::JointDrive& drive);
  double extent();

  void fill_rays(v1::RaysQuery& rays);
  void fill_vector(v1::Vector3& vector, const NumberRange& range);
  void fill_quaternion(v1::Quaternion& quaternion);
  void fill_position(v1::WorldPosition& position);
  void fill_body_ref(v1::BodyRef& body);
  void fill_joint_ref(v1::JointRef& joint);
  std::uint64_t any_id();

  Dice& dice_;
  const KnownWorld& world_;
  const bool is_valid_;
  AnyNumber numbers_;
  // The kind that is being drawn: which bodies suit it.
  const google::protobuf::Descriptor* kind_ = nullptr;
};

}  // namespace tessera
