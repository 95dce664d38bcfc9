#include "experiments/scale/scale.h"

#include <absl/strings/str_cat.h>

#include <string>
#include <utility>
#include <vector>

#include "cli/interrupt.h"
#include "experiments/scale/crowd.h"

namespace tessera {
namespace {

constexpr double kLookEvery = 0.5;  // s
constexpr double kLookAhead = 2;    // s

struct Entrant {
  std::string name;
  Sharing sharing;
};

std::vector<Entrant> entrants() {
  std::vector<Entrant> all = {{"none", {}}, {"grid", {.policy = BalancePolicy::kGrid, .every = kLookEvery}}};
  for (const BalancePolicy policy : kBalancePolicies) {
    if (!follows_load(policy)) continue;
    for (const double ahead : {0.0, kLookAhead}) {
      all.push_back({std::string(name_of(policy)), {.policy = policy, .every = kLookEvery, .ahead = ahead}});
    }
  }
  return all;
}

}  // namespace

absl::StatusOr<Report> measure_scale(const ExperimentOptions& options, const Progress& progress) {
  CrowdOptions crowd{.precision = options.precision};
  if (options.quick) {
    crowd.bodies = 600;
    crowd.ticks = 120;
  }
  const WorldDescription world = crowd_world(crowd);
  const std::vector<Entrant> all = entrants();
  ProgressCount count(progress, all.size());
  Report report;
  std::string undisturbed;
  for (const Entrant& one : all) {
    const absl::StatusOr<CrowdRun> run =
        run_crowd(world, crowd.ticks, one.sharing, [] { return !cli::interrupted(); });
    if (!run.ok()) return run.status();
    if (undisturbed.empty()) undisturbed = run->hash;
    const bool same = run->hash == undisturbed;
    if (!same) report.misses.push_back(absl::StrCat(one.name, ": other bits than without moves"));
    report.table("rows").push_back({{"engine", name_of(options.precision)},
                                    {"policy", one.name},
                                    {"ahead_s", one.sharing.ahead},
                                    {"largest_ms", run->largest_ms},
                                    {"mean_ms", run->mean_ms},
                                    {"largest_to_mean", run->largest_ms / run->mean_ms},
                                    {"largest_p99_ms", run->largest_p99_ms},
                                    {"late", run->late},
                                    {"ticks", crowd.ticks},
                                    {"real_time_factor", run->real_time_factor},
                                    {"moves", run->moves},
                                    {"moved_sectors", run->moved_sectors},
                                    {"moved_bodies", run->moved_bodies},
                                    {"moved_kb", run->moved_kb},
                                    {"exchanged_kb_per_tick", run->exchanged_kb},
                                    {"same_bits", same},
                                    {"hash", run->hash}});
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  return report;
}

}  // namespace tessera
