// What a run of a scene did: states at a few ticks, and what was measured in every tick.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <string>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/tick/messages.h"

namespace tessera::seams {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

// A dynamic body's centre frame; positions in m from the scene's origin.
struct Sample {
  BodyId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  bool asleep = false;
};

using Samples = std::vector<Sample>;  // ascending by id

struct Course {
  Samples start;
  Samples at_second;  // after 1 s
  Samples end;
  // Per body, over all ticks: the highest coordinates, m from the origin.
  std::vector<Eigen::Vector3d> highest;

  Tick ticks = 0;
  std::string world_hash;  // at the end
  // Largest change of the momentum, by the sum of all |m v| at the start.
  double momentum_drift = kNotMeasured;
  double energy_drift = kNotMeasured;  // largest change or rise, by the energy at the start
  double penetration_max = 0;          // m
  double penetration_end = 0;          // m, in the last tick with contacts
  double jolt_max = 0;  // m/s: largest change of a body's vertical velocity in a tick after 0.5 s
  double joint_gap_max = kNotMeasured;  // m: by how much a joint came apart at most
  std::uint64_t duplicate_events = 0;   // a pair more than once in a tick
  std::uint64_t broken_events = 0;  // a contact that begins twice, or goes on or ends without having begun
  std::uint64_t contact_begins = 0;
  std::uint64_t islands_across_seams = 0;  // the most in a tick
  std::uint64_t islands_cut = 0;           // likewise
};

// The largest distance (m) of a body's places in two samples of the same scene; infinite where one is no
// number.
double distance(const Samples& a, const Samples& b);

// The largest way (m) of a body from its start to its end.
double displacement(const Course& course);

// The height of the body that is the highest, m above the origin.
double top(const Samples& samples);

bool all_asleep(const Samples& samples);

}  // namespace tessera::seams
