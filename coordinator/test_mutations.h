// Each way in which one number or one reference of a command or query can be wrong, found by reflection: a
// new kind is tried without a line here.
#pragma once

#include <google/protobuf/message.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "command.pb.h"

namespace tessera {

// Called with the name of a field, while that one is wrong.
using LookAtField = std::function<void(const std::string& field)>;

// What `visit` does with the messages in `message`.
template <typename Visit>
void for_each_part(google::protobuf::Message& message, const Visit& visit) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const google::protobuf::FieldDescriptor* field : fields) {
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      visit(*reflection.MutableMessage(&message, field));
      continue;
    }
    for (int n = 0; n < reflection.FieldSize(message, field); ++n)
      visit(*reflection.MutableRepeatedMessage(&message, field, n));
  }
}

// One of its numbers after the other is not a number: all but those whose absence means something.
inline void with_each_number_wrong(google::protobuf::Message& message, const LookAtField& look) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  for (int n = 0; n < message.GetDescriptor()->field_count(); ++n) {
    const google::protobuf::FieldDescriptor* field = message.GetDescriptor()->field(n);
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE) continue;
    if (field->is_repeated()) {
      for (int place = 0; place < reflection.FieldSize(message, field); ++place) {
        const double old = reflection.GetRepeatedDouble(message, field, place);
        reflection.SetRepeatedDouble(&message, field, place, kNone);
        look(field->full_name());
        reflection.SetRepeatedDouble(&message, field, place, old);
      }
    } else if (!field->has_presence() || reflection.HasField(message, field)) {
      const double old = reflection.GetDouble(message, field);
      reflection.SetDouble(&message, field, kNone);
      look(field->full_name());
      reflection.SetDouble(&message, field, old);
    }
  }
  for_each_part(message, [&](google::protobuf::Message& part) { with_each_number_wrong(part, look); });
}

// One of its references after the other is to a body or joint that there is not.
inline void with_each_reference_wrong(google::protobuf::Message& message, const LookAtField& look) {
  const google::protobuf::Descriptor* type = message.GetDescriptor();
  if (type != v1::BodyRef::descriptor() && type != v1::JointRef::descriptor()) {
    for_each_part(message, [&](google::protobuf::Message& part) { with_each_reference_wrong(part, look); });
    return;
  }
  const std::string old = message.SerializeAsString();
  v1::BodyRef nobody;
  nobody.set_id(987'654'321);
  message.ParseFromString(nobody.SerializeAsString());  // both have the same fields
  look(type->full_name());
  message.ParseFromString(old);
}

}  // namespace tessera
