// One run of a world with some settings, for its error and its cost.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "cli/measure/positions.h"
#include "cli/measure/report.h"
#include "lpss/model/world_description.h"
#include "worlds/knobs.h"

namespace tessera {

// When runs of a world are compared: at moments that come between two ticks whatever their time step.
struct Moments {
  double interval;  // s, from the start and from each to the next
  int count;

  // Up to 32 moments, the last at `horizon` (s) or just after it; every time step must divide `coarsest_step`
  // (s).
  static Moments within(double horizon, double coarsest_step);
};

struct Trial {
  std::vector<Positions> samples;  // of all dynamic bodies, from the centre of the anchor's sector
  double cost_us = 0;              // of processor time, by body and simulated second
  double overlap_m = 0;            // the deepest at a sample
  double speed_m_s = 0;            // of the fastest body at the end
  std::string hash;
};

// Runs `world` to the last of the moments. `is_plain`: in one world without sectors, and without joints.
// Errors: those of Simulation::create() or PlainWorld::create().
absl::StatusOr<Trial> run_trial(const WorldDescription& world, const Moments& moments, bool is_plain = false);

// The largest distance (m) of a body in two runs of the same world, at any sample; infinite where one is no
// number.
double error_between(const std::vector<Positions>& a, const std::vector<Positions>& b);

// A table of samples, for a process that has another precision loaded, and back.
std::vector<Row> to_rows(const std::vector<Positions>& samples);
std::vector<Positions> samples_from(const std::vector<Row>& rows);

// The world with the knobs turned; bounds are checked. Errors: those of apply() and validate().
absl::StatusOr<WorldDescription> with_knobs(const WorldDescription& world, const Knobs& knobs);

// What no step of ours would improve much: double precision, an eighth of the world's time step in four small
// steps each, 60 passes. `coarser`: half as fine, which shows how far the reference can be trusted.
Knobs reference_knobs(const WorldSettings& settings, bool coarser);

// Marks in each row whether no other row of the same `group` is cheaper and more accurate: "front".
void mark_front(std::vector<Row>& rows, const std::vector<std::string>& group);

}  // namespace tessera
