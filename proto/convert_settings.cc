// The settings of a world as a message: by the fields of the names that kSettings has.
#include <absl/strings/str_cat.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/model/frame_keys.h"
#include "lpss/programs/module.h"
#include "proto/convert.h"

namespace tessera {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;

const FieldDescriptor& field_of(const WorldSetting& setting) {
  const FieldDescriptor* field = v1::WorldSettings::descriptor()->FindFieldByName(setting.name);
  invariant(field != nullptr, "every setting is a field of v1::WorldSettings");
  return *field;
}

template <typename Value>
void write(Value value, const FieldDescriptor& field, v1::WorldSettings& message) {
  const Reflection& reflection = *message.GetReflection();
  if constexpr (std::is_enum_v<Value>) {
    reflection.SetEnumValue(&message, &field, static_cast<int>(value));
  } else if constexpr (std::is_same_v<Value, bool>) {
    reflection.SetBool(&message, &field, value);
  } else if constexpr (std::is_same_v<Value, double>) {
    reflection.SetDouble(&message, &field, value);
  } else if constexpr (std::is_same_v<Value, std::uint64_t>) {
    reflection.SetUInt64(&message, &field, value);
  } else {
    reflection.SetUInt32(&message, &field, static_cast<std::uint32_t>(value));
  }
}

template <typename Value>
absl::Status read(const v1::WorldSettings& message, const FieldDescriptor& field, Value& value) {
  const Reflection& reflection = *message.GetReflection();
  if constexpr (std::is_enum_v<Value>) {
    const int number = reflection.GetEnumValue(message, &field);
    const auto found =
        std::ranges::find(all_of(value), number, [](Value one) { return static_cast<int>(one); });
    if (found == all_of(value).end()) return refused(field.name(), " = ", number, " is none of its values");
    value = *found;
  } else if constexpr (std::is_same_v<Value, bool>) {
    value = reflection.GetBool(message, &field);
  } else if constexpr (std::is_same_v<Value, double>) {
    value = reflection.GetDouble(message, &field);
  } else if constexpr (std::is_same_v<Value, std::uint64_t>) {
    value = reflection.GetUInt64(message, &field);
  } else {
    const std::uint32_t number = reflection.GetUInt32(message, &field);
    constexpr Value kMost = std::numeric_limits<Value>::max();
    if (number > static_cast<std::uint32_t>(kMost))
      return refused(field.name(), " = ", number, " must be at most ", kMost);
    value = static_cast<Value>(number);
  }
  return absl::OkStatus();
}

absl::StatusOr<Gravity> gravity(const v1::WorldSettings& settings) {
  switch (settings.gravity_case()) {
    case v1::WorldSettings::kUniformGravity:
      return UniformGravity{from_proto(settings.uniform_gravity())};
    case v1::WorldSettings::kCentralGravity: {
      const v1::CentralGravity& planet = settings.central_gravity();
      return CentralGravity{from_proto(planet.centre()), planet.surface(), planet.radius()};
    }
    case v1::WorldSettings::GRAVITY_NOT_SET:
      break;
  }
  return refused("gravity must be set, uniform or central");
}

v1::FrameKey to_proto(const FrameKey& key) {
  v1::FrameKey result;
  result.set_time(key.time);
  *result.mutable_pose() = tessera::to_proto(key.pose);
  if (key.velocity) *result.mutable_velocity() = tessera::to_proto(*key.velocity);
  if (key.spin) *result.mutable_spin() = tessera::to_proto(*key.spin);
  return result;
}

FrameKey key_from_proto(const v1::FrameKey& key) {
  FrameKey result{key.time(), from_proto(key.pose()), {}, {}};
  if (key.has_velocity()) result.velocity = from_proto(key.velocity());
  if (key.has_spin()) result.spin = from_proto(key.spin());
  return result;
}

v1::MovingFrame to_proto(const MovingFrame& frame) {
  v1::MovingFrame result;
  result.set_name(frame.name);
  *result.mutable_start() = tessera::to_proto(frame.start);
  *result.mutable_velocity() = tessera::to_proto(frame.velocity);
  *result.mutable_spin() = tessera::to_proto(frame.spin);
  result.set_falls(frame.falls);
  if (frame.region) {
    *result.mutable_region_centre() = tessera::to_proto(frame.region->centre);
    *result.mutable_region_size() = tessera::to_proto(frame.region->size);
  }
  for (const FrameLeg& leg : frame.legs) {
    v1::FrameLeg& added = *result.add_legs();
    added.set_seconds(leg.seconds);
    *added.mutable_acceleration() = tessera::to_proto(leg.acceleration);
  }
  for (const FrameKey& key : frame.keys) *result.add_keys() = to_proto(key);
  result.set_loops(frame.loops);
  if (frame.carrier) {
    result.mutable_carrier()->set_body(frame.carrier->body.value);
    *result.mutable_carrier()->mutable_pose() = tessera::to_proto(frame.carrier->pose);
  }
  return result;
}

MovingFrame frame_from_proto(const v1::MovingFrame& frame) {
  MovingFrame result;
  result.name = frame.name();
  result.start = from_proto(frame.start());
  result.velocity = from_proto(frame.velocity());
  result.spin = from_proto(frame.spin());
  result.falls = frame.falls();
  if (frame.has_region_size())
    result.region = FrameRegion{from_proto(frame.region_centre()), from_proto(frame.region_size())};
  for (const v1::FrameLeg& leg : frame.legs())
    result.legs.push_back({leg.seconds(), from_proto(leg.acceleration())});
  for (const v1::FrameKey& key : frame.keys()) result.keys.push_back(key_from_proto(key));
  result.loops = frame.loops();
  if (result.keys.size() <= kFrameKeysMax) smooth_keys(result.keys, result.loops);
  if (frame.has_carrier())
    result.carrier = FrameCarrier{BodyId{frame.carrier().body()}, from_proto(frame.carrier().pose())};
  return result;
}

}  // namespace

v1::WorldSettings to_proto(const WorldSettings& settings) {
  v1::WorldSettings result;
  for (const WorldSetting& setting : kSettings) {
    const FieldDescriptor& field = field_of(setting);
    std::visit([&](const auto member) { write(settings.*member, field, result); }, setting.member);
  }
  if (const auto* uniform = std::get_if<UniformGravity>(&settings.gravity)) {
    *result.mutable_uniform_gravity() = to_proto(uniform->acceleration);
  } else {
    const CentralGravity& planet = std::get<CentralGravity>(settings.gravity);
    *result.mutable_central_gravity()->mutable_centre() = to_proto(planet.centre);
    result.mutable_central_gravity()->set_surface(planet.surface);
    result.mutable_central_gravity()->set_radius(planet.radius);
  }
  for (const MovingFrame& frame : settings.frames) *result.add_frames() = to_proto(frame);
  for (const std::shared_ptr<const ProgramModule>& module : settings.modules)
    result.add_modules(module->bytes);
  return result;
}

absl::StatusOr<WorldSettings> from_proto(const v1::WorldSettings& message) {
  WorldSettings result;
  for (const WorldSetting& setting : kSettings) {
    const FieldDescriptor& field = field_of(setting);
    if (!message.GetReflection()->HasField(message, &field)) continue;
    const absl::Status status =
        std::visit([&](const auto member) { return read(message, field, result.*member); }, setting.member);
    if (!status.ok()) return status;
  }
  absl::StatusOr<Gravity> pull = gravity(message);
  if (!pull.ok()) return pull.status();
  result.gravity = *std::move(pull);
  if (message.frames_size() > static_cast<int>(kMovingFramesMax))
    return refused("frames: their number ", message.frames_size(), " must be at most ", kMovingFramesMax);
  for (const v1::MovingFrame& frame : message.frames()) result.frames.push_back(frame_from_proto(frame));
  if (message.modules_size() > static_cast<int>(kModulesMax))
    return refused("modules: their number ", message.modules_size(), " must be at most ", kModulesMax);
  for (int n = 0; n < message.modules_size(); ++n) {
    absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module(message.modules(n));
    if (!module.ok()) return in(absl::StrCat("module ", n), module.status());
    result.modules.push_back(*std::move(module));
  }
  return result;
}

}  // namespace tessera
