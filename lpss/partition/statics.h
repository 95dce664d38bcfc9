// Static bodies: every server knows all of them; sectors have the parts that they need.
#pragma once

#include <array>

#include "lpss/partition/partition.h"

namespace tessera {

// Adds a static body to the world, and to the engine worlds that it reaches into.
void add_static_body(Partition& partition, const BodyRecord& record);

// Removes it and wakes what rests on it. Nothing happens where there is no such static body.
void remove_static_body(Partition& partition, BodyId id);

// Changes how the surface of one moves, and wakes what touches it.
void set_static_surface_motion(Partition& partition, BodyId id, const std::array<double, 3>& velocity,
                               const std::array<double, 3>& running);

// Makes sure that every static body that reaches into `box` (m, relative to the sector's centre) is in the
// sector's engine world.
void add_statics(const Partition& partition, Sector& sector, const Eigen::AlignedBox3d& box);

// A box around a sector's centre.
Eigen::AlignedBox3d cube(double half_edge);

}  // namespace tessera
