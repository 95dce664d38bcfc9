// Static bodies: every server knows all of them; sectors have of them what they need.
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

// Has the tiles of ground made that sectors will need where awake bodies are going. Changes no bit. Once
// every few ticks is enough.
void look_ahead_for_ground(const Partition& partition);

// Around a sector's centre, the region for which a sector gets its cuts of large static bodies, whatever it
// needs them for: so these do not depend on what came when.
Eigen::AlignedBox3d region_of_cuts(double sector_size);

// A box around a sector's centre.
Eigen::AlignedBox3d cube(double half_edge);

}  // namespace tessera
