#include "experiments/seams/battery.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/seams/runner.h"

namespace tessera::seams {
namespace {

class Battery {
 public:
  Battery(const BatteryOptions& options, const RunRemotely& run_remotely, const Progress& progress,
          Results& results)
      : options_(options), run_remotely_(run_remotely), progress_(progress, 0), results_(results) {}

  absl::Status run() {
    const std::size_t runs = options_.placements.size() * options_.policies.size();
    progress_.expect(options_.scenes.size() * (runs + (compares_hashes() ? 3 : 2)));
    for (const Scene& scene : options_.scenes) {
      if (absl::Status status = run_scene(scene); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

 private:
  // Policy island alone promises the same bits however the work is distributed.
  bool compares_hashes() const {
    return std::ranges::find(options_.policies, Policy::kIsland) != options_.policies.end();
  }

  absl::Status run_scene(const Scene& scene) {
    const absl::StatusOr<Stage> middle =
        stage(scene, Placement::kReference, Policy::kIsland, options_.precision);
    if (!middle.ok()) return middle.status();
    const absl::StatusOr<Course> reference = seams::run(scene, *middle, scene.ticks);
    if (!reference.ok()) return reference.status();
    if (absl::Status status = progress_.advance(); !status.ok()) return status;
    const absl::StatusOr<double> error =
        noise(scene, *reference, options_.precision, options_.references_elsewhere);
    if (!error.ok()) return error.status();
    results_.noise.push_back({scene.name, *error});
    if (absl::Status status = progress_.advance(); !status.ok()) return status;
    for (const Policy policy : options_.policies) {
      if (absl::Status status = run_policy(scene, policy, *reference); !status.ok()) return status;
    }
    if (!compares_hashes()) return absl::OkStatus();
    absl::StatusOr<Equality> equality =
        compare_hashes(scene, Policy::kIsland, options_.precision, options_.hashes);
    if (!equality.ok()) return equality.status();
    results_.equalities.push_back(*std::move(equality));
    return progress_.advance();
  }

  absl::Status run_policy(const Scene& scene, Policy policy, const Course& reference) {
    std::optional<Row> local;  // the same world as in the remote placement
    for (const Placement placement : options_.placements) {
      const absl::StatusOr<Stage> stage = seams::stage(scene, placement, policy, options_.precision);
      if (!stage.ok()) return stage.status();
      const bool remote = placement == Placement::kRemote;
      Row row;
      if (remote && local) {
        row = *local;
      } else {
        absl::StatusOr<Course> course = seams::run(scene, *stage, scene.ticks);
        if (!course.ok()) return course.status();
        row = judged(scene, policy, *std::move(course), reference);
      }
      row.placement = placement;
      if (placement == Placement::kLocal) local = row;
      if (remote) {
        const absl::StatusOr<RemoteRun> run = run_remotely_(stage->world, scene.ticks, 0);
        if (!run.ok()) return run.status();
        row.same_bits = run->world_hash == row.course.world_hash;
      }
      results_.rows.push_back(std::move(row));
      if (absl::Status status = progress_.advance(); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  static Row judged(const Scene& scene, Policy policy, Course course, const Course& reference) {
    Row row;
    row.scene = scene.name;
    row.policy = policy;
    row.stands = scene.stands(course, reference);
    row.max_error_m = distance(course.at_second, reference.at_second);
    row.end_error_m = distance(course.end, reference.end);
    row.top_error_m = std::abs(top(course.end) - top(reference.end));
    row.asleep = all_asleep(course.end);
    course.start = course.at_second = course.end = {};
    course.highest = {};
    row.course = std::move(course);
    return row;
  }

  const BatteryOptions& options_;
  const RunRemotely& run_remotely_;
  ProgressCount progress_;
  Results& results_;
};

}  // namespace

absl::Status run_battery(const BatteryOptions& options, const RunRemotely& run_remotely,
                         const Progress& progress, Results& results) {
  return Battery(options, run_remotely, progress, results).run();
}

}  // namespace tessera::seams
