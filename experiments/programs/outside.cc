#include "experiments/programs/outside.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/local_servers.h"
#include "experiments/programs/people.h"

namespace tessera {
namespace {

constexpr int kServersBeside = 2;
constexpr double kWalkSpeed = 1.4;  // m/s
constexpr double kGoalRadius = 10;  // m, of goals around where a character started
constexpr double kArrived = 0.5;    // m
constexpr double kRise = 5;         // 1/s, by which a character comes to its height
constexpr Tick kTicksInCall = 60;

// That the loopback interface has received since the machine started.
double loopback_bytes() {
  std::ifstream file("/proc/net/dev");
  for (std::string name; file >> name;) {
    double bytes = 0;
    if (name == "lo:" && file >> bytes) return bytes;
  }
  return 0;
}

struct Calls {
  std::vector<double> call_ms;
  std::vector<double> sense_to_act;  // ticks
};

double quantile(std::vector<double>& values, double part) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// Characters that a client moves: what it has seen of them, and wants of them.
class Crowd {
 public:
  explicit Crowd(double sector_size) : sector_size_(sector_size) {}

  // What each does, and the questions for the next time.
  void write(Batch& batch) {
    RaysQuery feet;
    for (std::size_t n = 0; n < seen_.size(); ++n) {
      const BodySample& person = seen_[n];
      batch.commands.set_velocity(person.id, velocities_[n]);
      feet.rays.push_back({person.pose.position, {0, 0, -1}, 2 * kExampleStanding, person.id});
    }
    states_ = batch.queries.states({});
    rays_ = batch.queries.rays(feet);
  }

  void take(const Answers& answers) {
    seen_ = answers[states_];
    grounds_ = answers[rays_];
    if (goals_.empty()) {
      for (const BodySample& person : seen_) starts_.push_back(person.pose.position);
      goals_ = starts_;
    }
    velocities_.resize(seen_.size());
    for (std::size_t n = 0; n < seen_.size(); ++n) velocities_[n] = velocity_of(n);
  }

 private:
  Eigen::Vector3d velocity_of(std::size_t n) {
    const WorldPosition& at = seen_[n].pose.position;
    Eigen::Vector3d way = relative_to(goals_[n], at.sector, sector_size_) - at.local;
    way.z() = 0;
    if (way.norm() < kArrived) {
      const double radius = kGoalRadius * std::sqrt(dice_(source_));
      const double angle = 2 * std::numbers::pi * dice_(source_);
      goals_[n] = starts_[n];
      goals_[n].local += Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0);
    }
    Eigen::Vector3d velocity = kWalkSpeed * way.stableNormalized();
    if (n < grounds_.size() && grounds_[n]) velocity.z() = kRise * (kExampleStanding - grounds_[n]->distance);
    return velocity;
  }

  const double sector_size_;
  std::mt19937_64 source_{1};
  std::uniform_real_distribution<double> dice_;
  std::vector<WorldPosition> starts_;
  std::vector<WorldPosition> goals_;
  std::vector<BodySample> seen_;
  std::vector<std::optional<FirstHit>> grounds_;
  std::vector<Eigen::Vector3d> velocities_;
  QueryPlace<std::vector<BodySample>> states_;
  QueryPlace<std::vector<std::optional<FirstHit>>> rays_;
};

WorldDescription without_programs(WorldDescription world) {
  for (BodyDescription& body : world.bodies) body.programs.clear();
  return world;
}

class OutsideFigures {
 public:
  OutsideFigures(const ExperimentOptions& options, const Progress& progress)
      : precision_(options.precision), time_us_(options.quick ? 3e5 : 5e6), count_(progress, 4, report_) {}

  absl::StatusOr<Report> measure() {
    auto started = experiments::LocalServers::start(kServersBeside, precision_);
    if (!started.ok()) return started.status();
    servers_ = *std::move(started);
    const WorldDescription inside = wanderers_on_plane(precision_);
    const WorldDescription outside = without_programs(inside);
    for (const bool is_paced : {false, true}) {
      absl::Status status = add("client", is_paced, outside,
                                [&](Crowd& crowd, Calls& figures) { return act(crowd, is_paced, figures); });
      if (!status.ok()) return status;
    }
    for (const Tick ticks : {Tick{1}, kTicksInCall}) {
      absl::Status status = add(absl::StrCat("programs, ", ticks, " ticks a call"), false, inside,
                                [&](Crowd&, Calls& figures) { return step(ticks, figures); });
      if (!status.ok()) return status;
    }
    return std::move(report_);
  }

 private:
  using Once = std::function<absl::Status(Crowd&, Calls&)>;

  absl::Status add(const std::string& deciders, bool is_paced, const WorldDescription& world,
                   const Once& call) {
    Client& client = servers_->client();
    if (auto loaded = client.load(world, /*replace=*/true); !loaded.ok()) return loaded.status();
    if (is_paced) {
      if (absl::Status status = client.resume(1).status(); !status.ok()) return status;
    }
    Crowd crowd(world.settings.sector_size);
    Calls figures;
    if (absl::Status status = call(crowd, figures); !status.ok()) return status;  // sees all of it
    figures = {};
    const absl::StatusOr<ClusterStatus> before = client.status();
    if (!before.ok()) return before.status();
    const double bytes_before = loopback_bytes();
    const Stopwatch all;
    while (all.microseconds() < time_us_) {
      const Stopwatch watch;
      if (absl::Status status = call(crowd, figures); !status.ok()) return status;
      figures.call_ms.push_back(watch.microseconds() / 1e3);
    }
    const double seconds = all.microseconds() / 1e6;
    const double bytes = loopback_bytes() - bytes_before;
    const absl::StatusOr<ClusterStatus> after = client.status();
    if (!after.ok()) return after.status();
    const auto ticks = static_cast<double>(after->tick - before->tick);
    report_.table("rows").push_back({{"engine", name_of(precision_)},
                                     {"deciders", deciders},
                                     {"pace", is_paced ? "60 Hz" : "as fast as it goes"},
                                     {"ticks", after->tick - before->tick},
                                     {"ticks_per_second", ticks / seconds},
                                     {"p50_ms", quantile(figures.call_ms, 0.5)},
                                     {"p99_ms", quantile(figures.call_ms, 0.99)},
                                     {"sense_to_act_ticks", median(figures.sense_to_act)},
                                     {"network_bytes_per_tick", bytes / ticks}});
    return count_.advance();
  }

  // Waits for the next tick where the world runs; otherwise makes it.
  absl::Status act(Crowd& crowd, bool is_paced, Calls& figures) {
    Batch batch;
    crowd.write(batch);
    if (is_paced) {
      batch.after = seen_ + 1;
    } else {
      batch.ticks = 1;
    }
    const absl::StatusOr<Answers> answers = servers_->client().run(batch);
    if (!answers.ok()) return answers.status();
    figures.sense_to_act.push_back(static_cast<double>(answers->applied().tick) - static_cast<double>(seen_));
    seen_ = answers->tick();
    crowd.take(*answers);
    return absl::OkStatus();
  }

  absl::Status step(Tick ticks, Calls& figures) {
    figures.sense_to_act.push_back(1);
    return servers_->client().step(ticks).status();
  }

  const Precision precision_;
  const double time_us_;
  ProgressCount count_;
  std::unique_ptr<experiments::LocalServers> servers_;
  Report report_;
  Tick seen_ = 0;
};

}  // namespace

absl::StatusOr<Report> measure_outside(const ExperimentOptions& options, const Progress& progress) {
  return OutsideFigures(options, progress).measure();
}

}  // namespace tessera
