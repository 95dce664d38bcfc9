// States of bodies as messages have them, for users.
#pragma once

#include "proto/body_columns.h"
#include "tessera/stream.h"

namespace tessera {

inline BodySample sample_of(const BodyRow& row) {
  BodySample sample;
  sample.id = row.id;
  sample.pose = row.pose;
  sample.linear_velocity = row.linear_velocity;
  sample.angular_velocity = row.angular_velocity;
  sample.asleep = row.asleep;
  return sample;
}

}  // namespace tessera
