// Streams hear of programs whose numbers change, and of those that come to a server.
#include "lpss/observe/program_changes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/simulation/example_programs.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

BodyRecord with_sensor(BodyRecord body) {
  body.programs.push_back(example_program("imu"));
  return body;
}

std::vector<std::uint64_t> since(const ProgramChanges& changes, const Partition& partition,
                                 std::uint64_t look) {
  std::vector<std::uint64_t> ids;
  changes.for_each_since(partition, look, [&](const ProgramsView& of) { ids.push_back(of.id.value); });
  return ids;
}

TEST(ProgramChanges, AreOfWhatHasOtherNumbersThanAtTheLookBefore) {
  TestPartition partition;
  add_body(*partition, with_sensor(box(1, kHigh, {0, 0, 0})));
  add_body(*partition, with_sensor(box(2, kLow, {0, 0, 0})));
  add_body(*partition, box(3, kHigh, {3, 0, 0}));
  ProgramChanges changes;
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 0), ElementsAre(1, 2)) << "who is new is told of all";
  EXPECT_THAT(since(changes, *partition, 1), IsEmpty());
  body(*partition, 2).programs[0].values.assign(1, 0.5);
  changes.look(*partition);
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 1), ElementsAre(2)) << "whoever asks seldom hears of it, too";
  EXPECT_THAT(since(changes, *partition, 2), IsEmpty());
  body(*partition, 1).programs[0].fault = "it divides by 0";
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 3), ElementsAre(1));
}

TEST(ProgramChanges, AreOfWhatComesBackAsItWas) {
  TestPartition partition;
  add_body(*partition, with_sensor(box(1, kHigh, {0, 0, 0})));
  ProgramChanges changes;
  changes.look(*partition);
  remove_home(*partition, body(*partition, 1));
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 0), IsEmpty());
  add_body(*partition, with_sensor(box(1, kHigh, {0, 0, 0})));
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 2), ElementsAre(1)) << "another server may have told other numbers";
}

}  // namespace
}  // namespace tessera
