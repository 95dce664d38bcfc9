// Measures a run of a scene, tick by tick.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <span>
#include <utility>
#include <vector>

#include "experiments/seams/scene.h"
#include "experiments/seams/stage.h"
#include "lpss/simulation/simulation.h"

namespace tessera::seams {

class Recorder {
 public:
  // `stage` must outlive the recorder.
  Recorder(const Scene& scene, const Stage& stage, std::span<const JointRecord> joints);

  // The state after `tick` ticks, 0 included.
  void observe(Tick tick, const Simulation& simulation);

  // The measurements; `simulation` is at the end of the run.
  Course finish(const Simulation& simulation);

 private:
  struct Mass {
    double mass = 0;
    Eigen::Vector3d inertia;  // principal moments
    double weight = 0;        // N
  };

  Samples samples_of(const Simulation& simulation);
  void measure_momentum(const Samples& samples);
  void measure_energy(const Samples& samples);
  void measure_jolt(const Samples& samples, Tick tick);
  void measure_joints(const Samples& samples);
  void count_events(std::span<const ContactEvent> events);
  JointSide side_of(const JointProperties& joint, BodyId body, const Samples& samples) const;

  const Scene& scene_;
  const Stage& stage_;
  std::span<const JointRecord> joints_;
  Course course_;
  std::vector<Mass> masses_;                            // of the dynamic bodies, in the order of samples
  absl::flat_hash_map<BodyId, std::size_t> places_;     // of dynamic bodies in samples
  absl::flat_hash_map<BodyId, JointSide> fixed_sides_;  // of bodies that are not dynamic
  Samples last_;
  Eigen::Vector3d momentum_start_ = Eigen::Vector3d::Zero();
  double momentum_scale_ = 0;
  double energy_start_ = 0;
  double energy_lowest_ = 0;
  absl::flat_hash_set<std::pair<BodyId, BodyId>> touching_;
};

}  // namespace tessera::seams
