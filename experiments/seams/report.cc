#include "experiments/seams/report.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>

namespace tessera::seams {
namespace {

// JSON has no infinity.
nlohmann::json number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

double noise_of(const Results& results, const std::string& scene) {
  const auto found = std::find_if(results.noise.begin(), results.noise.end(),
                                  [&](const Noise& noise) { return noise.scene == scene; });
  return found == results.noise.end() ? kNotMeasured : found->error_m;
}

nlohmann::json to_json(const Row& row, const char* engine) {
  const Course& course = row.course;
  nlohmann::json json = {{"scene", row.scene},
                         {"placement", name_of(row.placement)},
                         {"policy", name_of(row.policy)},
                         {"engine", engine},
                         {"stands", row.stands},
                         {"max_error_m", number(row.max_error_m)},
                         {"end_error_m", number(row.end_error_m)},
                         {"top_error_m", number(row.top_error_m)},
                         {"momentum_drift", number(course.momentum_drift)},
                         {"energy_drift", number(course.energy_drift)},
                         {"max_penetration_m", number(course.penetration_max)},
                         {"end_penetration_m", number(course.penetration_end)},
                         {"max_joint_gap_m", number(course.joint_gap_max)},
                         {"max_jolt_m_s", number(course.jolt_max)},
                         {"duplicate_events", course.duplicate_events},
                         {"broken_events", course.broken_events},
                         {"asleep", row.asleep},
                         {"ticks", course.ticks},
                         {"islands_across_seams", course.islands_across_seams},
                         {"world_hash", course.world_hash}};
  if (row.same_bits) json["same_bits"] = *row.same_bits;
  return json;
}

nlohmann::json to_json(const Costs& costs, const char* engine) {
  nlohmann::json list = nlohmann::json::array();
  for (const TimeCost& cost : costs.times) {
    list.push_back({{"world", cost.world},
                    {"policy", cost.policy},
                    {"engine", engine},
                    {"ticks", cost.ticks},
                    {"tick_ms", cost.tick_ms},
                    {"hash", cost.hash}});
  }
  for (const SeamCost& cost : costs.seams) {
    list.push_back({{"world", cost.world},
                    {"servers", 2},
                    {"engine", engine},
                    {"ticks", cost.ticks},
                    {"tick_ms", cost.tick_ms},
                    {"bytes_per_tick", cost.bytes_per_tick},
                    {"bytes_per_tick_and_contact", cost.bytes_per_tick_and_contact},
                    {"contacts", cost.contacts},
                    {"hash", cost.hash}});
  }
  return list;
}

nlohmann::json equal_hashes(const Results& results) {
  nlohmann::json json = nlohmann::json::object();
  for (const Equality& equality : results.equalities) {
    json[equality.scene][name_of(equality.policy)] = {
        {"ticks", equality.ticks},
        {"world_hash", equality.world_hash},
        {"seeds", equality.seeds},
        {"seeds_equal", equality.seeds_equal},
        {"shuffles", equality.shuffles},
        {"shuffles_equal", equality.shuffles_equal},
        {"ten_partitions_equal", equality.ten_partitions_equal}};
  }
  for (const Row& row : results.rows) {
    if (row.same_bits) json[row.scene][name_of(row.policy)]["two_servers_equal"] = *row.same_bits;
  }
  return json;
}

// The row of the same scene and policy without a seam; null if it was not run.
const Row* reference_of(const Results& results, const Row& row) {
  const auto found = std::find_if(results.rows.begin(), results.rows.end(), [&](const Row& other) {
    return other.scene == row.scene && other.policy == row.policy && other.placement == Placement::kReference;
  });
  return found == results.rows.end() ? nullptr : &*found;
}

void judge_island(const Row& row, double noise, Precision precision, std::vector<std::string>& reasons) {
  const double drift_max = precision == Precision::kFloat32 ? 1e-6 : 1e-12;
  if (row.course.momentum_drift > drift_max) {
    reasons.push_back(absl::StrFormat("momentum drifts by %.2g", row.course.momentum_drift));
  }
  if (row.placement != Placement::kReference && row.max_error_m > noise) {
    reasons.push_back(absl::StrFormat("error %.2g m, noise %.2g m", row.max_error_m, noise));
  }
}

std::string cell(double value) { return std::isfinite(value) ? absl::StrFormat("%.6g", value) : ""; }

}  // namespace

nlohmann::json to_json(const Results& results, const Costs& costs, Precision precision) {
  const char* engine = name_of(precision);
  nlohmann::json rows = nlohmann::json::array();
  for (const Row& row : results.rows) rows.push_back(to_json(row, engine));
  nlohmann::json noise = nlohmann::json::array();
  for (const Noise& entry : results.noise) {
    noise.push_back({{"scene", entry.scene}, {"engine", engine}, {"error_m", number(entry.error_m)}});
  }
  return {{"engine", engine},
          {"rows", rows},
          {"noise", noise},
          {"costs", to_json(costs, engine)},
          {"equal_hashes", equal_hashes(results)}};
}

std::string to_csv(const Results& results, Precision precision) {
  std::string text =
      "scene,placement,policy,engine,stands,max_error_m,noise_m,end_error_m,top_error_m,momentum_drift,"
      "energy_drift,"
      "max_penetration_m,max_joint_gap_m,max_jolt_m_s,duplicate_events,broken_events,asleep,ticks,world_"
      "hash\n";
  for (const Row& row : results.rows) {
    const Course& course = row.course;
    absl::StrAppend(
        &text,
        absl::StrJoin({row.scene, std::string(name_of(row.placement)), std::string(name_of(row.policy)),
                       std::string(name_of(precision)), absl::StrCat(row.stands ? 1 : 0),
                       cell(row.max_error_m), cell(noise_of(results, row.scene)), cell(row.end_error_m),
                       cell(row.top_error_m), cell(course.momentum_drift), cell(course.energy_drift),
                       cell(course.penetration_max), cell(course.joint_gap_max), cell(course.jolt_max),
                       absl::StrCat(course.duplicate_events), absl::StrCat(course.broken_events),
                       absl::StrCat(row.asleep ? 1 : 0), absl::StrCat(course.ticks), course.world_hash},
                      ","),
        "\n");
  }
  return text;
}

std::string to_csv(const Costs& costs) {
  std::string text = "world,policy,tick_ms,bytes_per_tick,bytes_per_tick_and_contact,contacts,hash\n";
  for (const TimeCost& cost : costs.times) {
    absl::StrAppend(&text, cost.world, ",", cost.policy, ",", cell(cost.tick_ms), ",,,,", cost.hash, "\n");
  }
  for (const SeamCost& cost : costs.seams) {
    absl::StrAppend(&text, cost.world, ",two servers,", cell(cost.tick_ms), ",", cell(cost.bytes_per_tick),
                    ",", cell(cost.bytes_per_tick_and_contact), ",", cell(cost.contacts), ",", cost.hash,
                    "\n");
  }
  return text;
}

std::vector<std::string> misses(const Results& results, Precision precision) {
  std::vector<std::string> list;
  for (const Row& row : results.rows) {
    if (row.policy != Policy::kIsland) continue;
    std::vector<std::string> reasons;
    const Row* reference = reference_of(results, row);
    if (!row.stands)
      reasons.push_back(reference != nullptr && !reference->stands ? "falls, as does the reference"
                                                                   : "falls");
    if (row.course.duplicate_events > 0) reasons.push_back("duplicate events");
    if (row.course.broken_events > 0) reasons.push_back("broken events");
    if (row.same_bits == false) reasons.push_back("different bits on two servers");
    judge_island(row, noise_of(results, row.scene), precision, reasons);
    if (reasons.empty()) continue;
    list.push_back(absl::StrCat(row.scene, " ", name_of(row.placement), " ", name_of(row.policy), ": ",
                                absl::StrJoin(reasons, "; ")));
  }
  for (const Equality& equality : results.equalities) {
    if (equality.holds()) continue;
    list.push_back(absl::StrCat(equality.scene, " ", name_of(equality.policy), ": same bits in ",
                                equality.seeds_equal, " of ", equality.seeds, " seeds, ",
                                equality.shuffles_equal, " of ", equality.shuffles, " shuffles",
                                equality.ten_partitions_equal ? "" : ", not on ten servers"));
  }
  return list;
}

}  // namespace tessera::seams
