#include "experiments/seams/runner.h"

#include <algorithm>
#include <cmath>

#include "cli/interrupt.h"
#include "experiments/seams/recorder.h"
#include "lpss/simulation/simulation.h"

namespace tessera::seams {

absl::StatusOr<Course> run(const Scene& scene, const Stage& stage, Tick ticks) {
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(stage.world);
  if (!simulation.ok()) return simulation.status();
  const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(stage.world);
  if (!joints.ok()) return joints.status();
  (*simulation)->report_contacts(true);
  Recorder recorder(scene, stage, *joints);
  recorder.observe(0, **simulation);
  for (Tick tick = 1; tick <= ticks; ++tick) {
    if (cli::interrupted()) return absl::CancelledError("interrupted");
    (*simulation)->step();
    recorder.observe(tick, **simulation);
  }
  return recorder.finish(**simulation);
}

absl::StatusOr<double> noise(const Scene& scene, const Course& reference, Precision precision, int places) {
  double largest = 0;
  for (int place = 0; place < places; ++place) {
    const absl::StatusOr<Stage> elsewhere = stage_elsewhere(scene, place, precision);
    if (!elsewhere.ok()) return elsewhere.status();
    const Tick second = static_cast<Tick>(std::lround(1 / elsewhere->world.settings.time_step));
    const absl::StatusOr<Course> course = run(scene, *elsewhere, second);
    if (!course.ok()) return course.status();
    largest = std::max(largest, distance(course->at_second, reference.at_second));
  }
  return largest;
}

}  // namespace tessera::seams
