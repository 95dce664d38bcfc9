#include "simulator/shrink.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace tessera {
namespace {

using ::testing::ElementsAre;

Scenario large() {
  Scenario scenario{.seed = 7, .servers = 4, .ticks = 100, .commands = 40};
  scenario.faults.fill(2);
  return scenario;
}

bool has(const Scenario& scenario, std::uint32_t fault) {
  return !scenario.only_faults ||
         std::count(scenario.only_faults->begin(), scenario.only_faults->end(), fault) > 0;
}

bool has_command(const Scenario& scenario, std::uint32_t command) {
  return command < scenario.commands &&
         (!scenario.only_commands || std::ranges::count(*scenario.only_commands, command) > 0);
}

TEST(Shrink, KeepsWhatAFailureNeeds) {
  // It needs two faults, five commands, the last of them, and ten ticks.
  const auto run = [](const Scenario& scenario) -> absl::Status {
    const bool fails =
        has(scenario, 3) && has(scenario, 17) && has_command(scenario, 4) && scenario.ticks >= 10;
    return fails ? absl::AbortedError("as before") : absl::OkStatus();
  };
  const Shrunk shrunk = shrink(large(), absl::AbortedError("first"), run, 1000);
  EXPECT_THAT(*shrunk.scenario.only_faults, ElementsAre(3, 17));
  EXPECT_EQ(shrunk.scenario.commands, 5u);
  EXPECT_THAT(*shrunk.scenario.only_commands, ElementsAre(4));
  EXPECT_EQ(shrunk.scenario.ticks, 12u);
  EXPECT_EQ(shrunk.scenario.servers, 1u);
  EXPECT_EQ(shrunk.failure.message(), "as before");
}

TEST(Shrink, StopsAtItsLimitAndAtOtherErrors) {
  int runs = 0;
  const auto never = [&runs](const Scenario&) {
    ++runs;
    return absl::OkStatus();
  };
  EXPECT_EQ(shrink(large(), absl::AbortedError(""), never, 10).tries, 10);
  EXPECT_EQ(runs, 10);
  const auto interrupted = [](const Scenario&) { return absl::CancelledError(""); };
  EXPECT_EQ(shrink(large(), absl::AbortedError(""), interrupted, 10).tries, 1);
}

TEST(Shrink, PlacesAreWrittenAsRanges) {
  EXPECT_EQ(text_of_places({}), "none");
  EXPECT_EQ(text_of_places({7}), "7");
  EXPECT_EQ(text_of_places({0, 1, 2, 5, 7, 8}), "0-2,5,7-8");
}

TEST(Shrink, NoFaultAtAllMayBeNeeded) {
  const auto always = [](const Scenario&) { return absl::AbortedError("always"); };
  const Shrunk shrunk = shrink(large(), absl::AbortedError(""), always, 1000);
  EXPECT_TRUE(shrunk.scenario.only_faults->empty());
  EXPECT_EQ(shrunk.scenario.commands, 0u);
  EXPECT_THAT(command_of(shrunk.scenario, "w.sdf"),
              ::testing::StartsWith("tessera simulate w.sdf --seed 7 --servers 1 --ticks 1 --cuts 2"));
  EXPECT_THAT(command_of(shrunk.scenario), ::testing::EndsWith("--only-faults none"));
}

}  // namespace
}  // namespace tessera
