// Bodies and joints by their ids or names, as messages have them.
#pragma once

#include "command.pb.h"
#include "tessera/batch.h"

namespace tessera {

inline v1::BodyRef reference_to(const BodyName& body) {
  v1::BodyRef reference;
  if (const BodyId* id = std::get_if<BodyId>(&body)) {
    reference.set_id(id->value);
  } else {
    reference.set_name(std::get<std::string>(body));
  }
  return reference;
}

inline v1::JointRef reference_to(const JointName& joint) {
  v1::JointRef reference;
  if (const JointId* id = std::get_if<JointId>(&joint)) {
    reference.set_id(id->value);
  } else {
    reference.set_name(std::get<std::string>(joint));
  }
  return reference;
}

}  // namespace tessera
