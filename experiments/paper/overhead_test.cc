// Every phase has a measurement, and the bodies rest on seams.
#include "experiments/paper/overhead.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>
#include <string>

namespace tessera {
namespace {

const Progress kSilent = [](std::uint64_t, std::uint64_t, const Report&) { return true; };
constexpr std::array kBodies = {128, 256};

std::string run_of(const Row& row) {
  return row["seams"].dump() + row["substeps"].dump() + row["bodies"].dump();
}

TEST(OverheadExperiment, EveryPhaseHasItsShareOfTheTick) {
  absl::StatusOr<Report> report = measure_overhead_of(Precision::kFloat32, kBodies, 3, kSilent);
  ASSERT_TRUE(report.ok()) << report.status();
  std::map<std::string, double> ticks_us;
  for (const Row& row : report->table("ticks")) ticks_us[run_of(row)] = row["tick_us"];
  EXPECT_EQ(ticks_us.size(), 6u);
  std::map<std::string, std::set<std::string>> phases;
  for (const Row& row : report->table("rows")) {
    EXPECT_DOUBLE_EQ(row["share"].get<double>() * ticks_us.at(run_of(row)), row["us"].get<double>()) << row;
    phases[run_of(row)].insert(row["phase"]);
  }
  EXPECT_EQ(phases.size(), 6u);
  for (const auto& [run, names] : phases) {
    EXPECT_EQ(names,
              (std::set<std::string>{"sectorization", "seam search", "exchange", "cloning", "detection",
                                     "islands", "solving", "integration", "programs", "hashing"}))
        << run;
  }
}

TEST(OverheadExperiment, TowersStandOnSeams) {
  absl::StatusOr<Report> report = measure_overhead_of(Precision::kFloat32, kBodies, 2, kSilent);
  ASSERT_TRUE(report.ok()) << report.status();
  std::set<std::string> hashes;
  for (const Row& row : report->table("ticks")) {
    EXPECT_EQ(row["sectors"], 4) << row;
    EXPECT_GT(row["clones"], 0) << row;
    EXPECT_GE(row["contacts"], row["bodies"]) << row;
    EXPECT_EQ(row["ticks"], 2) << row;
    EXPECT_DOUBLE_EQ(row["ratio"].get<double>() * row["plain_us"].get<double>(), row["tick_us"].get<double>())
        << row;
    if (row["seams"] == "island") {
      EXPECT_GE(row["islands_across_seams"], 4) << row;
    } else {
      EXPECT_EQ(row["islands_across_seams"], 0) << row << ": each sector solves its clones by itself";
    }
    hashes.insert(row["hash"]);
  }
  EXPECT_EQ(hashes.size(), 6u) << "each setting and number of bodies has its own hash";
  absl::StatusOr<Report> again = measure_overhead_of(Precision::kFloat32, kBodies, 2, kSilent);
  ASSERT_TRUE(again.ok()) << again.status();
  for (const Row& row : again->table("ticks")) EXPECT_TRUE(hashes.contains(row["hash"])) << row;
}

TEST(OverheadExperiment, EndsWhenAsked) {
  const Progress stop = [](std::uint64_t, std::uint64_t, const Report&) { return false; };
  EXPECT_EQ(measure_overhead_of(Precision::kFloat32, kBodies, 1, stop).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace tessera
