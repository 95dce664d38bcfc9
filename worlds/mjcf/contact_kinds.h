// Which geoms collide, as bits.
#pragma once

#include <mujoco/mjmodel.h>

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "worlds/loader/notices.h"

namespace tessera::mjcf {

struct ContactBits {
  std::uint32_t category = 0;
  std::uint32_t mask = 0;
};

// Bodies that do not collide with each other, as pairs of carriers with the lower one first.
using Apart = std::set<std::pair<int, int>>;

// By geom: bits with which just those pairs collide that collide in MuJoCo. In MuJoCo a pair collides if the
// contype of one matches the conaffinity of the other, unless it is excluded, or if the file lists it. Geoms
// that collide alike share a bit; bit 0 is that of geoms with MuJoCo's defaults, and of the bodies of other
// files. Geoms that collide with nothing have no bits. `carriers` are the bodies that geoms move with, by
// MuJoCo's body. Files with more kinds of geoms than bits lose exclusions and pairs, which `notices` says.
std::vector<ContactBits> contact_bits(const mjModel& model, const std::vector<int>& carriers,
                                      const Apart& apart, Notices& notices);

}  // namespace tessera::mjcf
