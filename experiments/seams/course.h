// The course of a run: states at a few ticks, and measurements over all ticks.
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

// A dynamic body's centre-of-mass frame; positions in m from the scene's origin.
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
  // Per body, over all ticks: the largest coordinates, m from the origin.
  std::vector<Eigen::Vector3d> highest;

  Tick ticks = 0;
  std::string world_hash;  // at the end
  // Largest change of the momentum, relative to the sum of all |m v| at the start.
  double momentum_drift = kNotMeasured;
  double energy_drift = kNotMeasured;  // largest change or rise, relative to the energy at the start
  double penetration_max = 0;          // m
  double penetration_end = 0;          // m, in the last tick with contacts
  double jolt_max = 0;  // m/s: largest change of a body's vertical velocity in one tick after 0.5 s
  double joint_gap_max = kNotMeasured;  // m: largest gap of a joint
  std::uint64_t duplicate_events = 0;   // a pair more than once in a tick
  std::uint64_t broken_events = 0;  // a contact that begins twice, or persists or ends without having begun
  std::uint64_t contact_begins = 0;
  std::uint64_t islands_across_seams = 0;  // maximum in a tick
};

// The largest distance (m) between a body's positions in two samples of the same scene; infinite if one is
// not a number.
double distance(const Samples& a, const Samples& b);

// The largest distance (m) of a body's end from its start.
double displacement(const Course& course);

// The height of the highest body, m above the origin.
double top(const Samples& samples);

bool all_asleep(const Samples& samples);

}  // namespace tessera::seams
