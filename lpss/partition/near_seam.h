// Who is near a border, who must be cloned where, and who changes home: pure functions of one body.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "lpss/grid/offset_set.h"
#include "lpss/model/body.h"

namespace tessera {

// How far (m) things stand out of their sectors in one world, the same on all its servers.
struct SeamMargins {
  double sector_size = 128;
  // A body keeps its home until its centre is this far outside of it, so that nothing plays ping-pong.
  double hysteresis = 0;
  // How far a body that lives in a sector may reach out of the sector's cube: its radius, the hysteresis, and
  // the way it goes between leaving and being taken over.
  double reach = 0;
  double usual_way = 0;  // that a body goes in a tick, at most, unless it is fast
};

// The fastest body (m/s) in contact whose late change of home is covered by `reach`.
inline constexpr double kSeamSpeed = 50;

// The margins of a world of sectors of `sector_size` m and ticks of `time_step` s, whose largest dynamic or
// kinematic body has the radius `radius_max` m.
SeamMargins seam_margins(double sector_size, double time_step, double radius_max);

// Of longer ways of a tick, which pass over more sectors, what comes after so many pieces of a sector's
// length is not looked at.
inline constexpr int kWayPiecesMax = 256;

// The sectors, relative to the body's home and without the home itself, that a body comes so near to in a
// tick that one living there could touch it. `swept` (m, relative to the home sector's centre) holds its box
// all along its `way` (m).
OffsetSet sectors_within_reach(const Eigen::AlignedBox3d& swept, const Eigen::Vector3d& way,
                               const SeamMargins& margins);

// Of two fast bodies that meet, the home of the slower one finds the contact, so the faster one is told to
// all sectors where a slower one may come from. Of bodies that go farther in a tick than so many times a
// sector's length, these are not looked for.
inline constexpr double kChaseMax = 2;

// Those sectors. A body that goes no farther than this one and meets it on its way starts within a ball
// around the way's end, whose radius is the way's length. As sectors_within_reach() otherwise.
OffsetSet homes_of_slower(const Eigen::AlignedBox3d& swept, const Eigen::Vector3d& way,
                          const SeamMargins& margins, double surge = 0);

// Whether a body that goes so far in a tick (m), and may be carried on by a surge (m, SectorWorld::surge()),
// may meet bodies that are too far inside their sectors to be told to others.
inline bool is_fast(const Eigen::Vector3d& way, const SeamMargins& margins, double surge = 0) {
  const double usual = margins.usual_way - surge;
  return usual < 0 || way.squaredNorm() > usual * usual;
}

// Of those within reach, the ones that need a clone. A dynamic pair is detected in the lexicographically
// lower of its two home sectors, so dynamic bodies are cloned downwards only; kinematic ones, like statics,
// and fast ones wherever a dynamic body may meet them.
OffsetSet clone_targets(const OffsetSet& within_reach, Motion motion, bool is_fast);

// The sector that detects the contacts of two bodies: the one rule that every server knows. Statics have no
// say: their partner's home detects. If one of two dynamic bodies is fast, the home of the slower one
// detects, whichever that is (Range in engine.h); this lasts for a tick, and nothing follows from it for the
// next.
const SectorIndex& detecting_sector(Motion motion_a, const SectorIndex& home_a, Motion motion_b,
                                    const SectorIndex& home_b);

// The sector that looks at a trigger of one body and at the other: likewise, and so of kinematic and static
// bodies, of which one is not static. Of two that are both dynamic or both kinematic, the lower home.
const SectorIndex& sensing_sector(Motion motion_a, const SectorIndex& home_a, Motion motion_b,
                                  const SectorIndex& home_b);

// The offset to the new home of a body at `position` (m, relative to its home's centre): none while it is
// inside its sector or within the hysteresis around it.
std::optional<SectorOffset> leaves_home(const Eigen::Vector3d& position, const SeamMargins& margins);

// The same of a body that goes a `way` (m) in this tick. A change takes effect in the next one, so a dynamic
// body that is fast moves to the sector where it is going to be.
std::optional<SectorOffset> leaves_home(const Eigen::Vector3d& position, const Eigen::Vector3d& way,
                                        Motion motion, const SeamMargins& margins);

// `state` as seen from the centre of the sector `offset` away.
BodyState seen_from(const BodyState& state, const SectorOffset& offset, double sector_size);

// The box that a ball of `radius` around the body's centre sweeps in `dt` seconds.
Eigen::AlignedBox3d swept_ball(const BodyState& state, double radius, double dt);
Eigen::AlignedBox3d swept_ball(const Eigen::Vector3d& centre, const Eigen::Vector3d& velocity, double radius,
                               double dt);

}  // namespace tessera
