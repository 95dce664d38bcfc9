#include "experiments/joints/models.h"

#include <absl/status/status.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/own_process.h"
#include "cli/measure/stopwatch.h"
#include "experiments/joints/on_plane.h"
#include "experiments/scenes.h"
#include "lpss/observe/mechanics.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/partition_cluster.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace models {
namespace {

constexpr double kSeconds = 10;
constexpr double kQuickSeconds = 2;
constexpr double kProcessorTimeMax = 20;                 // s, of all ticks
constexpr std::chrono::seconds kProcessorTimeKill{120};  // of loading, too
constexpr double kGapMax = 1e-3;                         // m

// MuJoCo's files end as any XML does. Parts of others have no world.
bool is_mjcf(const std::filesystem::path& file) {
  if (file.extension() != ".xml") return false;
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const bool is_whole = absl::StrContains(text, "<mujoco>") || absl::StrContains(text, "<mujoco ");
  return is_whole && absl::StrContains(text, "<worldbody");
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code ignored;
  const auto options = std::filesystem::directory_options::skip_permission_denied;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, options, ignored)) {
    const std::string ending = entry.path().extension().string();
    const bool is_world = ending == ".sdf" || ending == ".urdf" || ending == ".world";
    if (entry.is_regular_file(ignored) && (is_world || is_mjcf(entry.path())))
      files.push_back(std::filesystem::relative(entry.path(), folder));
  }
  std::ranges::sort(files);
  return files;
}

bool is_passive(const WorldDescription& world) {
  return std::ranges::none_of(world.joints,
                              [](const JointDescription& joint) {
                                return joint.drives != JointDrives{} ||
                                       std::ranges::any_of(joint.properties.axes, [](const JointAxis& axis) {
                                         return axis.spring_stiffness != 0;
                                       });
                              }) &&
         std::ranges::none_of(world.bodies, [](const BodyDescription& body) {
           return body.properties.motion == Motion::kKinematic || body.properties.surface.has_value();
         });
}

std::vector<BodyRecord> bodies_of(PartitionCluster& cluster) {
  std::vector<BodyRecord> bodies;
  for_each_body(cluster.partition(0), [&](const BodyRecord& body) { bodies.push_back(body); });
  return bodies;
}

std::string account_of(const Divergence& divergence, const WorldDescription& world) {
  std::string account = absl::StrCat("tick ", divergence.tick, ", ", name_of(divergence.kind));
  if (divergence.body.value >= 1 && divergence.body.value <= world.bodies.size())
    absl::StrAppend(&account, ", ", world.bodies[divergence.body.value - 1].name);
  if (divergence.joint.value >= 1 && divergence.joint.value <= world.joints.size())
    absl::StrAppend(&account, ", ", world.joints[divergence.joint.value - 1].name);
  return account;
}

// Runs a world in one and in two partitions, and notes what it does.
absl::Status run(const WorldDescription& world, double seconds, Row& row) {
  absl::StatusOr<std::unique_ptr<PartitionCluster>> one = PartitionCluster::create(world, 1);
  if (!one.ok()) return one.status();
  absl::StatusOr<std::unique_ptr<PartitionCluster>> two = PartitionCluster::create(world, 2);
  if (!two.ok()) return two.status();
  absl::StatusOr<MechanicsOfWorld> mechanics = MechanicsOfWorld::create(world);
  if (!mechanics.ok()) return mechanics.status();
  const double dt = world.settings.time_step;
  const Mechanics start = mechanics->at(bodies_of(**one));
  double gap = 0, kinetic = 0, gain = 0;
  std::uint64_t diverged = 0;
  std::vector<double> ticks_us;
  const std::chrono::nanoseconds begin = processor_time();
  while (static_cast<double>(ticks_us.size()) * dt < seconds &&
         microseconds(processor_time() - begin) < kProcessorTimeMax * 1e6) {
    const Stopwatch watch;  // with a limit on it, the clock of the processor time is a coarse one
    (*one)->step();
    ticks_us.push_back(watch.microseconds());
    (*two)->step();
    const std::vector<Divergence> divergences = (*one)->divergences();
    if (diverged == 0 && !divergences.empty()) row["first"] = account_of(divergences.front(), world);
    diverged += (*one)->counts().diverged;
    const Mechanics now = mechanics->at(bodies_of(**one), dt / world.settings.substeps / 2);
    gap = std::max(gap, now.gap);
    kinetic = std::max(kinetic, now.kinetic);
    gain = std::max(gain, now.energy() - start.energy());
  }
  double speed = 0;
  for (const BodyRecord& body : bodies_of(**one))
    speed = std::max(speed, Eigen::Vector3d(body.state.linear_velocity.data()).norm());
  row["seconds"] = static_cast<double>(ticks_us.size()) * dt;
  if (!world.joints.empty()) {
    row["start_gap_mm"] = start.gap * 1e3;
    row["gap_mm"] = gap * 1e3;
  }
  row["diverged"] = diverged;
  row["awake"] = (*one)->counts().bodies_awake;
  row["speed_m_s"] = speed;
  row["kinetic_j"] = kinetic;
  if (is_passive(world)) row["energy_gain_j"] = gain;
  row["same_bits"] = (*one)->hash() == (*two)->hash();
  row["tick_us"] = ticks_us.empty() ? Row() : Row(median(ticks_us));
  row["hash"] = (*one)->hash().to_string();
  return absl::OkStatus();
}

// All columns, so that each row has them in one order.
Row empty_row(const std::string& file, Precision precision) {
  Row row = {{"engine", name_of(precision)}, {"file", file}};
  for (const char* column :
       {"outcome",       "message",   "bodies",   "joints", "repairs",   "notices",   "seconds",
        "start_gap_mm",  "gap_mm",    "diverged", "first",  "awake",     "speed_m_s", "kinetic_j",
        "energy_gain_j", "same_bits", "tick_us",  "hash",   "lowest_mm", "wheels",    "wheel_way"})
    row[column] = Row();
  return row;
}

Row measured(const std::filesystem::path& folder, const std::string& file, const ExperimentOptions& options) {
  Row row = empty_row(file, options.precision);
  const auto refuse = [&](const absl::Status& status) {
    row["outcome"] = "refused";
    row["message"] = status.ToString();
    return row;
  };
  absl::StatusOr<LoadedWorld> loaded = load_world_file(folder / file);
  if (!loaded.ok()) return refuse(loaded.status());
  WorldDescription& world = loaded->world;
  world.settings.precision = options.precision;
  row["outcome"] = loaded->repairs.empty() ? "loads" : "repaired";
  row["bodies"] = world.bodies.size();
  row["joints"] = world.joints.size();
  row["repairs"] = absl::StrJoin(loaded->repairs, "; ");
  row["notices"] = absl::StrJoin(loaded->notices, "; ");
  if (absl::Status status = run(world, options.quick ? kQuickSeconds : kSeconds, row); !status.ok())
    return refuse(status);
  if (!is_robot(world)) return row;
  const absl::StatusOr<OnPlane> on_plane = set_on_plane(std::move(world));
  if (!on_plane.ok()) return refuse(on_plane.status());
  row["lowest_mm"] = on_plane->lowest * 1e3;
  row["wheels"] = on_plane->wheels;
  if (on_plane->wheel_way) row["wheel_way"] = *on_plane->wheel_way;
  return row;
}

// In a process of its own.
absl::StatusOr<Row> row_of(const std::filesystem::path& folder, const std::string& file,
                           const ExperimentOptions& options) {
  const auto measure = [&]() -> absl::StatusOr<Report> {
    Report one;
    one.table("rows").push_back(measured(folder, file, options));
    return one;
  };
  absl::StatusOr<Report> report = in_own_process(measure, kProcessorTimeKill);
  if (report.ok()) return report->table("rows").front();
  if (absl::IsCancelled(report.status())) return report.status();
  Row row = empty_row(file, options.precision);
  row["outcome"] = "crashed";
  row["message"] = std::string(report.status().message());
  return row;
}

bool is_apart(const Row& row) {
  return row["gap_mm"].is_number() && row["gap_mm"].get<double>() > kGapMax * 1e3;
}
bool has_diverged(const Row& row) { return row["diverged"].is_number() && row["diverged"].get<int>() > 0; }
bool has_sunk(const Row& row) {
  return row["lowest_mm"].is_number() && row["lowest_mm"].get<double>() < -kSunkMax * 1e3;
}
bool has_slipped(const Row& row) {
  return row["wheel_way"].is_number() && !(std::abs(row["wheel_way"].get<double>() - 1) <= kWheelWayError);
}
bool has_other_bits(const Row& row) { return row["same_bits"].is_boolean() && !row["same_bits"].get<bool>(); }

void add_misses(const Row& row, std::vector<std::string>& misses) {
  const auto miss = [&](const std::string& what) {
    misses.push_back(
        absl::StrCat(row["engine"].get<std::string>(), ", ", row["file"].get<std::string>(), ": ", what));
  };
  if (row["outcome"] == "crashed") miss(absl::StrCat("crashed: ", row["message"].get<std::string>()));
  if (is_apart(row)) miss(absl::StrFormat("a joint opens by %.3g mm", row["gap_mm"].get<double>()));
  if (has_diverged(row)) miss(absl::StrCat("diverges: ", row["first"].get<std::string>()));
  if (has_other_bits(row)) miss("other bits in two partitions");
  if (has_sunk(row)) miss(absl::StrFormat("sinks to %.3g mm below a plane", -row["lowest_mm"].get<double>()));
  if (has_slipped(row))
    miss(absl::StrFormat("its wheels cover %.3g of radius times angle", row["wheel_way"].get<double>()));
}

// By the first folder of the files.
void add_outcomes(const std::vector<Row>& rows, std::vector<Row>& outcomes) {
  std::map<std::string, Row> folders;
  for (const Row& row : rows) {
    const std::filesystem::path file(row["file"].get<std::string>());
    const std::string name = file.has_parent_path() ? file.begin()->string() : ".";
    auto [found, is_new] = folders.try_emplace(name);
    Row& folder = found->second;
    if (is_new) {
      folder = {{"engine", row["engine"]}, {"folder", name}};
      for (const char* column : {"files", "loads", "repaired", "refused", "crashed", "diverged", "apart",
                                 "other_bits", "sunk", "slipped"})
        folder[column] = 0;
    }
    const auto add = [&](const std::string& column, bool one) {
      folder[column] = folder[column].get<int>() + (one ? 1 : 0);
    };
    add("files", true);
    add(row["outcome"].get<std::string>(), true);
    add("diverged", has_diverged(row));
    add("apart", is_apart(row));
    add("other_bits", has_other_bits(row));
    add("sunk", has_sunk(row));
    add("slipped", has_slipped(row));
  }
  for (auto& [name, folder] : folders) outcomes.push_back(std::move(folder));
}

}  // namespace
}  // namespace models

absl::StatusOr<Report> measure_models(const ExperimentOptions& options, const Progress& progress) {
  if (options.worlds.empty())
    return absl::InvalidArgumentError("neither --worlds nor TESSERA_WORLDS names a folder of world files");
  std::vector<std::filesystem::path> files = models::files_in(options.worlds);
  std::erase_if(files, [&](const std::filesystem::path& file) {
    return !absl::StrContains(file.string(), options.only);
  });
  if (files.empty())
    return absl::InvalidArgumentError(absl::StrCat("no .sdf, .world, .urdf or MJCF file in ", options.worlds,
                                                   " whose path contains \"", options.only, "\""));
  absl::StatusOr<Report> report = measure_each(files, progress, [&](const std::filesystem::path& file) {
    absl::StatusOr<Row> row = models::row_of(options.worlds, file.string(), options);
    if (!row.ok()) return absl::StatusOr<Report>(row.status());
    Report one;
    models::add_misses(*row, one.misses);
    one.table("rows").push_back(*std::move(row));
    return absl::StatusOr<Report>(std::move(one));
  });
  if (report.ok()) models::add_outcomes(report->table("rows"), report->table("outcomes"));
  return report;
}

}  // namespace tessera
