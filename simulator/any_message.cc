#include "simulator/any_message.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/limits.h"
#include "lpss/model/limits.h"
#include "proto/convert.h"
#include "proto/ray_columns.h"

namespace tessera {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;

constexpr double kNear = 3;                // m, from where something is
constexpr std::uint64_t kElementsMax = 3;  // of most lists
constexpr std::uint64_t kFarOneIn = 30;
constexpr double kHuge = 1e300;
constexpr std::uint64_t kEverythingOneIn = 50;
constexpr std::ptrdiff_t kRemovedMax = 5;

// By the names of fields, which mean the same in all messages. Vectors have the range for each coordinate.
struct NamedRange {
  std::string_view name;
  NumberRange range;
};
constexpr NamedRange kRanges[] = {
    {"linear", {-kSpeedMax / 2, kSpeedMax / 2}},
    {"linear_velocity", {-kSpeedMax / 2, kSpeedMax / 2}},
    {"angular", {-kAngularSpeedMax / 2, kAngularSpeedMax / 2}},
    {"angular_velocity", {-kAngularSpeedMax / 2, kAngularSpeedMax / 2}},
    {"impulse", {-kImpulseMax / 2, kImpulseMax / 2}},
    {"lever", {-kLeverMax / 2, kLeverMax / 2, 0.5}},
    {"force", {-kForceMax / 2, kForceMax / 2, 100}},
    {"torque", {-kTorqueMax / 2, kTorqueMax / 2}},
    {"velocity", {-kSurfaceSpeedMax / 2, kSurfaceSpeedMax / 2, 3}},
    {"running", {-kSurfaceSpeedMax / 2, kSurfaceSpeedMax / 2, 3}},
    {"mass", {kMassMin, kMassMax}},
    {"friction", {0, kHuge, 1}},
    {"second_friction", {0, kHuge, 1}},
    {"torsional_friction", {0, kHuge, 1}},
    {"rolling_friction", {0, kRollingFrictionMax, 0.1}},
    {"patch_radius", {0, kPatchRadiusMax, 0.1}},
    {"restitution", {0, 1}},
    {"linear_damping", {0, 1}},
    {"angular_damping", {0, 1}},
    {"direction", {-kHuge, kHuge, 1}},
    {"local", {-kHuge, kHuge, 1}},
    {"position", {-kHuge, kHuge, 1}},
    {"length", {std::numeric_limits<double>::denorm_min(), kRayLengthMax, 50}},
    {"positions", {-kDriveWayMax, kDriveWayMax, 3}},
    {"rates", {-kSpeedMax, kSpeedMax}},
    {"accelerations", {-kHuge, kHuge}},
};

template <typename To>
To* cast(google::protobuf::Message& message) {
  return google::protobuf::DynamicCastToGenerated<To>(&message);
}

}  // namespace

v1::Command AnyMessage::command() {
  v1::Command command;
  fill_any_kind(command);
  return command;
}

v1::Query AnyMessage::query() {
  v1::Query query;
  fill_any_kind(query);
  return query;
}

// A message that is a oneof and nothing else.
void AnyMessage::fill_any_kind(Message& message) {
  const google::protobuf::OneofDescriptor& kinds = *message.GetDescriptor()->oneof_decl(0);
  const Field& kind = *kinds.field(static_cast<int>(dice_.below(kinds.field_count())));
  kind_ = kind.message_type();
  Message& drawn = *message.GetReflection()->MutableMessage(&message, &kind);
  if (!fill_special(drawn, &kind)) fill(drawn);
}

void AnyMessage::fill(Message& message) {
  const Descriptor& type = *message.GetDescriptor();
  for (int n = 0; n < type.real_oneof_decl_count(); ++n) fill_one_of(message, *type.oneof_decl(n));
  for (int n = 0; n < type.field_count(); ++n) {
    if (type.field(n)->real_containing_oneof() == nullptr) fill_field(message, *type.field(n));
  }
}

void AnyMessage::fill_one_of(Message& message, const Oneof& oneof) {
  if (!is_valid_ && dice_.one_in(20)) return;
  fill_field(message, *oneof.field(static_cast<int>(dice_.below(oneof.field_count()))));
}

void AnyMessage::fill_field(Message& message, const Field& field) {
  if (field.is_map()) return;
  if (field.is_repeated()) {
    const bool depends_on_others = field.name() == "accelerations" || field.name() == "points";
    if (is_valid_ && depends_on_others) return;
    for (std::uint64_t left = dice_.below(kElementsMax + 1); left > 0; --left) fill_element(message, field);
    return;
  }
  const bool may_be_absent = field.has_presence() && field.real_containing_oneof() == nullptr;
  if (may_be_absent && field.cpp_type() != Field::CPPTYPE_MESSAGE && dice_.one_in(2)) return;
  if (may_be_absent && field.cpp_type() == Field::CPPTYPE_MESSAGE && !is_valid_ && dice_.one_in(10)) return;
  if (field.cpp_type() != Field::CPPTYPE_MESSAGE) return fill_scalar(message, field);
  Message& part = *message.GetReflection()->MutableMessage(&message, &field);
  if (!fill_special(part, &field)) fill(part);
}

void AnyMessage::fill_element(Message& message, const Field& field) {
  if (field.cpp_type() != Field::CPPTYPE_MESSAGE) return fill_scalar(message, field);
  Message& part = *message.GetReflection()->AddMessage(&message, &field);
  if (!fill_special(part, &field)) fill(part);
}

// Sets it, or adds an element.
void AnyMessage::fill_scalar(Message& message, const Field& field) {
  const Reflection& reflection = *message.GetReflection();
  const bool is_list = field.is_repeated();
  switch (field.cpp_type()) {
    case Field::CPPTYPE_DOUBLE: {
      const double number = numbers_.within(range_of(field));
      is_list ? reflection.AddDouble(&message, &field, number)
              : reflection.SetDouble(&message, &field, number);
      return;
    }
    case Field::CPPTYPE_UINT64: {
      const std::uint64_t number = integer_of(field);
      is_list ? reflection.AddUInt64(&message, &field, number)
              : reflection.SetUInt64(&message, &field, number);
      return;
    }
    case Field::CPPTYPE_UINT32: {
      const auto number = static_cast<std::uint32_t>(integer_of(field));
      is_list ? reflection.AddUInt32(&message, &field, number)
              : reflection.SetUInt32(&message, &field, number);
      return;
    }
    case Field::CPPTYPE_ENUM: {
      const google::protobuf::EnumDescriptor& values = *field.enum_type();
      const bool is_known = is_valid_ || !dice_.one_in(20);
      const int value =
          is_known ? values.value(static_cast<int>(dice_.below(values.value_count())))->number() : 77;
      is_list ? reflection.AddEnumValue(&message, &field, value)
              : reflection.SetEnumValue(&message, &field, value);
      return;
    }
    case Field::CPPTYPE_BOOL:
      if (!is_list) reflection.SetBool(&message, &field, dice_.one_in(3));
      return;
    case Field::CPPTYPE_STRING:
      if (!is_list) reflection.SetString(&message, &field, text_of(field));
      return;
    default:
      return;
  }
}

NumberRange AnyMessage::range_of(const Field& field) const {
  const double size = world_.settings.sector_size;
  if (field.name() == "radius") return {0, kRadialSectorsMax * size, size};
  if (field.name() == "reach") return {0, kReachMax * size, size};
  if (field.name() == "length") return {1e-9, std::min(kRayLengthMax, kRaySectorsMax * size / 2), 50};
  for (const NamedRange& named : kRanges) {
    if (named.name == field.name()) return named.range;
  }
  return {-kHuge, kHuge};
}

std::uint64_t AnyMessage::integer_of(const Field& field) {
  if (field.name() == "ids") return any_id();
  if (field.name() == "mask" || field.name() == "category") {
    constexpr std::array<std::uint64_t, 4> kBits = {0, UINT32_MAX, 1, 0x80000002};
    return kBits[dice_.one_in(3) ? dice_.below(kBits.size()) : 1];
  }
  return numbers_.count();
}

std::string AnyMessage::text_of(const Field& field) {
  if (field.type() == Field::TYPE_BYTES) {
    const std::size_t longest = kUserDataBytesMax + (is_valid_ ? 0 : 1);
    return std::string(dice_.one_in(4) ? longest : dice_.below(40), '\xff');
  }
  if (field.name() == "owner") return dice_.one_in(4) ? "somebody" : "";
  if (!is_valid_ && dice_.one_in(4)) return std::string(kNameBytesMax + dice_.below(2), 'n');
  const bool is_prefix = field.name().find("prefix") != std::string::npos;
  if (is_prefix && !world_.bodies.empty() && dice_.one_in(2)) {
    const std::string& name = world_.bodies[dice_.below(world_.bodies.size())].name;
    return name.substr(0, 1 + dice_.below(name.size() + 1));
  }
  return dice_.one_in(3) ? "" : "any" + std::to_string(dice_.below(100'000'000));
}

bool AnyMessage::fill_special(Message& message, const Field* as) {
  if (auto* body = cast<v1::BodyRef>(message)) return fill_body_ref(*body), true;
  if (auto* joint = cast<v1::JointRef>(message)) return fill_joint_ref(*joint), true;
  if (auto* model = cast<v1::Model>(message)) return fill_model(*model), true;
  if (auto* joint = cast<v1::Joint>(message)) return fill_joint(*joint), true;
  if (auto* drives = cast<v1::SetJointDrives>(message)) return fill_drives(*drives), true;
  if (auto* drives = cast<v1::DriveJoints>(message)) return fill_drives(*drives), true;
  if (auto* state = cast<v1::SetState>(message)) return fill_state(*state), true;
  if (auto* removal = cast<v1::Remove>(message)) return fill_removal(*removal), true;
  if (auto* told = cast<v1::TellProgram>(message)) return fill_tell(*told), true;
  if (auto* rays = cast<v1::RaysQuery>(message)) return fill_rays(*rays), true;
  if (auto* geometry = cast<v1::Geometry>(message)) return fill_geometry(*geometry, false), true;
  if (auto* turned = cast<v1::Quaternion>(message)) return fill_quaternion(*turned), true;
  if (auto* position = cast<v1::WorldPosition>(message)) return fill_position(*position), true;
  if (auto* vector = cast<v1::Vector3>(message)) {
    if (as->name() == "inertia") {  // which its mass suits or does not
      const double moment = numbers_.within({kInertiaMin, kInertiaMax, 1});
      vector->set_x(moment);
      vector->set_y(moment);
      vector->set_z(moment);
    } else {
      fill_vector(*vector, range_of(*as));
    }
    return true;
  }
  return false;
}

void AnyMessage::fill_vector(v1::Vector3& vector, const NumberRange& range) {
  const bool is_along_one_axis = dice_.one_in(3);
  vector.set_x(numbers_.within(range));
  if (is_along_one_axis) return;
  vector.set_y(numbers_.within(range));
  vector.set_z(numbers_.within(range));
}

void AnyMessage::fill_quaternion(v1::Quaternion& quaternion) {
  if (!is_valid_ && dice_.one_in(6)) {
    quaternion.set_x(numbers_.within({-1, 1}));
    quaternion.set_w(numbers_.within({-1, 1}));
    return;
  }
  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
  if (!dice_.one_in(3)) {
    const auto number = [this] { return dice_.between(-1.0, 1.0); };
    turned = Eigen::Quaterniond(1.5 * number(), number(), number(), number() + 1e-3).normalized();
  }
  quaternion = to_proto(turned);
}

void AnyMessage::fill_position(v1::WorldPosition& position) {
  WorldPosition at = world_.places[dice_.below(world_.places.size())];
  if (dice_.one_in(kFarOneIn)) {
    constexpr std::array<std::int64_t, 6> kFar = {INT64_MAX, INT64_MIN, INT64_MAX - 1, std::int64_t{1} << 62,
                                                  1'000'000, -3};
    at.sector.i = kFar[dice_.below(kFar.size())];
    if (dice_.one_in(2)) at.sector.k = kFar[dice_.below(kFar.size())];
  }
  for (int axis = 0; axis < 3; ++axis) {
    at.local[axis] += numbers_.within({-world_.settings.sector_size, world_.settings.sector_size, kNear});
  }
  position = to_proto(at);
}

std::uint64_t AnyMessage::any_id() {
  if (world_.bodies.empty() || (!is_valid_ && dice_.one_in(5))) return numbers_.count();
  return world_.bodies[dice_.below(world_.bodies.size())].id;
}

// Places a body and, by a joint, its child; or more than that, which may contradict each other.
void AnyMessage::fill_state(v1::SetState& command) {
  if (!is_valid_ || world_.joints.empty()) return fill(command);
  const KnownWorld::Joint& joint = world_.joints[dice_.below(world_.joints.size())];
  if (joint.parent != 0) {
    v1::SetState::OfBody& parent = *command.add_bodies();
    fill(parent);
    parent.mutable_body()->set_id(joint.parent);
  }
  v1::SetState::OfJoint& child = *command.add_joints();
  child.mutable_joint()->set_id(joint.id);
  if (joint.type == v1::JOINT_BALL) return fill_quaternion(*child.mutable_orientation());
  if (joint.type == v1::JOINT_FIXED || dice_.one_in(4)) return;
  child.add_positions(numbers_.within({-3, 3, 1}));
  if (dice_.one_in(2)) child.add_rates(numbers_.within({-kAngularSpeedMax / 2, kAngularSpeedMax / 2}));
}

// Columns that agree, of which one may be short: one element for all rays.
void AnyMessage::fill_rays(v1::RaysQuery& rays) {
  fill(rays);
  if (!is_valid_ && dice_.one_in(3)) return;
  v1::RaysQuery drawn;
  RayWriter writer(drawn);
  const google::protobuf::Descriptor& single = *v1::RayQuery::descriptor();
  for (std::uint64_t left = dice_.below(kElementsMax + 1); left > 0; --left) {
    v1::WorldPosition origin;
    fill_position(origin);
    v1::Vector3 direction;
    fill_vector(direction, range_of(*single.FindFieldByName("direction")));
    writer.add({from_proto(origin), from_proto(direction),
                numbers_.within(range_of(*single.FindFieldByName("length"))),
                BodyId{dice_.one_in(2) ? 0 : any_id()}});
  }
  if (drawn.lengths_size() > 1 && dice_.one_in(3)) drawn.mutable_lengths()->Truncate(1);
  drawn.set_mask(rays.mask());
  drawn.mutable_except()->Swap(rays.mutable_except());
  rays = std::move(drawn);
}

// A prefix that many bodies have is rare, for it would leave nothing.
void AnyMessage::fill_removal(v1::Remove& command) {
  fill(command);
  if (command.what_case() != v1::Remove::kPrefix || dice_.one_in(kEverythingOneIn)) return;
  const auto has_prefix = [&command](const KnownWorld::Body& body) {
    return body.name.starts_with(command.prefix());
  };
  if (std::ranges::count_if(world_.bodies, has_prefix) > kRemovedMax) fill_body_ref(*command.mutable_body());
}

// Most commands want a body that moves, and some a kinematic one.
void AnyMessage::fill_body_ref(v1::BodyRef& body) {
  if (!is_valid_ && dice_.one_in(10)) {
    if (dice_.one_in(2)) return body.set_id(any_id());
    return body.set_name(std::string(dice_.below(3), 'x'));
  }
  v1::Motion motion = v1::MOTION_DYNAMIC;
  if (kind_ == v1::SetKinematicTarget::descriptor()) motion = v1::MOTION_KINEMATIC;
  if (kind_ == v1::SetVelocity::descriptor() || kind_ == v1::Teleport::descriptor())
    motion = dice_.one_in(3) ? v1::MOTION_KINEMATIC : v1::MOTION_DYNAMIC;
  if (kind_ == v1::SetSurfaceMotion::descriptor() && dice_.one_in(2)) motion = v1::MOTION_STATIC;
  std::vector<std::uint64_t> suitable;
  for (const KnownWorld::Body& known : world_.bodies) {
    if (known.motion == motion) suitable.push_back(known.id);
  }
  const std::uint64_t id = suitable.empty() ? any_id() : suitable[dice_.below(suitable.size())];
  const auto known = std::ranges::find(world_.bodies, id, &KnownWorld::Body::id);
  if (known != world_.bodies.end() && dice_.one_in(3)) return body.set_name(known->name);
  body.set_id(id);
}

void AnyMessage::fill_joint_ref(v1::JointRef& joint) {
  if (world_.joints.empty() || (!is_valid_ && dice_.one_in(10))) {
    if (dice_.one_in(2)) return joint.set_id(numbers_.count());
    return joint.set_name(std::string(dice_.below(3), 'x'));
  }
  const KnownWorld::Joint& known = world_.joints[dice_.below(world_.joints.size())];
  dice_.one_in(3) ? joint.set_name(known.name) : joint.set_id(known.id);
}

}  // namespace tessera
