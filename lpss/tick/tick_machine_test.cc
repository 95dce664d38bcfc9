// The order of the rounds of a tick, and who takes part in them.
#include "lpss/tick/tick_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"
#include "lpss/tick/transfer.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// The numbers of the rounds of a tick, for a world on one server.
std::vector<std::uint32_t> rounds_of_a_tick(TickMachine& machine, std::span<const Command> commands = {}) {
  std::vector<std::uint32_t> numbers;
  for (std::optional<Round> round = machine.begin_tick(commands); round;
       round = machine.advance(std::move(round->to))) {
    numbers.push_back(round->number);
  }
  return numbers;
}

std::uint32_t number_of(RoundKind kind) { return make_round(kind, 1).number; }

TEST(TickMachine, ATickIsExchangeSeamsShipmentAndSolution) {
  TestPartition partition;
  add_body(*partition, box(1, kHigh, {0, 0, 0}));
  TickMachine machine(*partition, {});
  EXPECT_THAT(rounds_of_a_tick(machine),
              ElementsAre(number_of(RoundKind::kExchange), number_of(RoundKind::kSeams),
                          number_of(RoundKind::kShipment), number_of(RoundKind::kSolution)));
  check_invariants(*partition);
}

TEST(TickMachine, TheMapChangesBetweenTicks) {
  TestPartition partition;
  add_body(*partition, box(1, kLow, kBeforeBorder));
  add_body(*partition, box(2, kHigh, kBehindBorder));
  TickMachine machine(*partition, {});
  Round round = *machine.change_map({SectorMap(partition->anchor, {}, 2)});
  EXPECT_EQ(round.number, number_of(RoundKind::kTransfer));
  EXPECT_FALSE(machine.advance(std::move(round.to)));
  EXPECT_EQ(partition->map.epoch(), 2u);
  EXPECT_EQ(rounds_of_a_tick(machine).size(), 4u) << "and the tick is as ever";
  EXPECT_EQ(machine.counts().islands_across_seams, 1u);
  check_invariants(*partition);
}

TEST(TickMachine, AllTakePartInSeamsAndOnlyThoseConcernedInShipments) {
  std::vector<std::unique_ptr<TestPartition>> partitions;
  std::vector<std::unique_ptr<TickMachine>> machines;
  std::vector<std::optional<Round>> rounds;
  for (const Rank rank : {0, 1}) {
    TestPartition& partition = *partitions.emplace_back(new TestPartition(test_settings(), 2, rank));
    add_body(*partition, box(1, kLow, kBeforeBorder));
    add_body(*partition, box(2, kHigh, kBehindBorder));
    machines.push_back(std::make_unique<TickMachine>(*partition, TickMachine::Options{}));
    rounds.push_back(machines[rank]->begin_tick({}));
  }
  const auto go_on = [&] {
    std::vector<std::optional<Round>> next;
    for (const Rank rank : {0, 1}) {
      next.push_back(machines[rank]->advance({rounds[0]->to[rank], rounds[1]->to[rank]}));
    }
    rounds = std::move(next);
  };
  for (const RoundKind kind : {RoundKind::kExchange, RoundKind::kSeams}) {
    for (const auto& round : rounds) {
      EXPECT_EQ(round->number, number_of(kind));
      EXPECT_THAT(round->from, ElementsAre(true, true));
    }
    go_on();
  }
  EXPECT_THAT(rounds[0]->from, ElementsAre(false, true)) << "the lower one solves";
  EXPECT_THAT(rounds[1]->from, ElementsAre(false, false));
  EXPECT_FALSE(rounds[0]->to[1]);
  EXPECT_TRUE(rounds[1]->to[0]);
  go_on();
  EXPECT_THAT(rounds[1]->from, ElementsAre(true, true));
  EXPECT_TRUE(rounds[0]->to[1]);
  go_on();
  EXPECT_FALSE(rounds[0]);
  EXPECT_FALSE(rounds[1]);
}

TEST(TickMachine, AWorldAtRestIsSilentUntilACommandComes) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kHigh, {0, 0, 0}), Activity::kAsleep));
  TickMachine machine(*partition, {});
  EXPECT_EQ(rounds_of_a_tick(machine).size(), 4u) << "others do not know of the body yet";
  EXPECT_THAT(rounds_of_a_tick(machine), ElementsAre(number_of(RoundKind::kExchange)));
  EXPECT_THAT(rounds_of_a_tick(machine), IsEmpty());
  EXPECT_EQ(machine.counts().sectors, 1u);
  const std::vector<Command> commands{SetVelocity{BodyId{1}, {1, 0, 0}, {}}};
  EXPECT_EQ(rounds_of_a_tick(machine, commands).size(), 4u);
  EXPECT_THAT(state_of(*partition, 1).position, ElementsAre(1.0 / 64, 0, 0));
}

TEST(TickMachine, ATickWithACommandIsAWholeOneEvenWhereNothingComesOfIt) {
  TestPartition partition;
  TickMachine machine(*partition, {});
  EXPECT_EQ(rounds_of_a_tick(machine, std::vector<Command>{RemoveBody{BodyId{9}}}).size(), 4u);
  EXPECT_EQ(rounds_of_a_tick(machine).size(), 1u);
}

TEST(TickMachineDeathTest, AMessageOfAnotherRoundStopsTheProcess) {
  TestPartition partition;
  TickMachine machine(*partition, {});
  std::optional<Round> round = machine.begin_tick({});
  EXPECT_DEATH(machine.begin_tick({}), "a tick begins after the last one has ended");
  round->to[0] = Solution{};
  EXPECT_DEATH(machine.advance(std::move(round->to)), "a message belongs to the round that it was sent in");
}

}  // namespace
}  // namespace tessera
