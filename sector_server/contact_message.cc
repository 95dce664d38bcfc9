#include "sector_server/contact_message.h"

#include "proto/convert.h"

namespace tessera {

v1::Contact to_proto(BodyId a, BodyId b, const ContactPatch& patch) {
  v1::Contact contact;
  contact.set_a(a.value);
  contact.set_b(b.value);
  *contact.mutable_position() = to_proto(patch.position);
  *contact.mutable_normal() = to_proto(Eigen::Vector3d(patch.normal.data()));
  contact.set_impulse(patch.impulse);
  *contact.mutable_friction() = to_proto(Eigen::Vector3d(patch.friction.data()));
  for (const TouchingPoint& point : patch.points) {
    for (const double coordinate : point.position) contact.add_points(coordinate);
    contact.add_depths(point.depth);
    contact.add_impulses(point.impulse);
  }
  return contact;
}

}  // namespace tessera
