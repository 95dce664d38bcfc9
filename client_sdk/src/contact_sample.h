// Patches of contact as messages have them, for users.
#pragma once

#include <algorithm>
#include <vector>

#include "proto/convert.h"
#include "query.pb.h"
#include "tessera/stream.h"

namespace tessera {

inline ContactPhase phase_of(v1::Contact::Phase phase) {
  if (phase == v1::Contact::BEGIN) return ContactPhase::kBegin;
  return phase == v1::Contact::END ? ContactPhase::kEnd : ContactPhase::kPersist;
}

inline std::vector<ContactPointSample> points_of(const v1::Contact& contact) {
  std::vector<ContactPointSample> points;
  const int count = std::min({contact.points_size() / 3, contact.depths_size(), contact.impulses_size()});
  for (int n = 0; n < count; ++n) {
    points.push_back({{contact.points(3 * n), contact.points(3 * n + 1), contact.points(3 * n + 2)},
                      contact.depths(n),
                      contact.impulses(n)});
  }
  return points;
}

inline ContactSample contact_sample(const v1::Contact& contact) {
  return {phase_of(contact.phase()),      BodyId{contact.a()},          BodyId{contact.b()},
          from_proto(contact.position()), from_proto(contact.normal()), contact.impulse(),
          from_proto(contact.friction()), points_of(contact),           contact.trigger()};
}

}  // namespace tessera
