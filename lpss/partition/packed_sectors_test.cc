#include "lpss/partition/packed_sectors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "lpss/partition/moved_sector.h"
#include "lpss/partition/test_moved_sector.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Optional;

MovedClone clone_of(std::uint64_t id, const SectorIndex& home) {
  const BodyRecord record = in_state(box(id, home, {7, 1e-9, -0.0}), Activity::kAsleep);
  MovedClone clone;
  clone.introduction = {record.id, record.properties};
  clone.update = {record.id, home, home, OffsetSet({SectorOffset{-1, 0, 0}, SectorOffset{0, 5, 0}}),
                  record.state};
  clone.placed = true;
  return clone;
}

MovedSector sector_at_rest() {
  MovedSector sector;
  sector.sector = {std::numeric_limits<std::int64_t>::max(), 3, -7};
  for (const std::uint64_t id : {7u, 1'000'000u}) {
    BodyRecord record = in_state(box(id, sector.sector, {0.1, -2, 1.0 / 3}), Activity::kAsleep);
    record.state.still_for = 0.5;
    MovedBody& body = sector.bodies.emplace_back();
    body.record = record;
    body.replicated_in = OffsetSet({SectorOffset{1, 0, 0}});
  }
  sector.bodies[1].record.properties.surface = Surface{.rolling_friction = 0.1};
  sector.clones.push_back(clone_of(3, {std::numeric_limits<std::int64_t>::min(), 3, -7}));
  sector.manifolds.push_back({BodyId{3}, BodyId{7}, std::string("points\0\0\0\0\0\0\0\0\0and more\0", 24)});
  sector.touching = {{BodyId{3}, BodyId{7}}};
  sector.overlaps = {{BodyId{17}, BodyId{3}}};
  sector.static_region = {-8.5, -8.5, -8.5, 8.5, 8.5, 8.5};
  sector.parts_reported = true;
  return sector;
}

TEST(PackedSectors, GiveBackWhatTheyGot) {
  const MovedSector sector = sector_at_rest();
  PackedSectors packed;
  packed.add(sector, {});
  EXPECT_EQ(packed.counts().bodies, 2u);
  expect_equal(packed.copy(sector.sector), sector);
  expect_equal(packed.take(sector.sector), sector);
  EXPECT_EQ(packed.counts().sectors, 0u);
  EXPECT_EQ(packed.counts().bytes, 0u);
}

TEST(PackedSectors, TellWhichHaveChanged) {
  const MovedSector sector = sector_at_rest();
  PackedSectors packed;
  packed.add(sector, {});
  EXPECT_EQ(packed.take_changed(), std::nullopt) << "nobody has asked before";
  EXPECT_THAT(packed.take_changed(), Optional(IsEmpty()));
  packed.take(sector.sector);
  packed.add(sector, {});
  EXPECT_THAT(packed.take_changed(), Optional(ElementsAre(sector.sector)));
  packed.take(sector.sector);
  EXPECT_THAT(packed.take_changed(), Optional(ElementsAre(sector.sector)));
  packed.report_contacts(true);
  EXPECT_EQ(packed.take_changed(), std::nullopt) << "all have others that touch";
}

TEST(PackedSectors, AreFoundByBodiesAndClones) {
  const MovedSector sector = sector_at_rest();
  PackedSectors packed;
  packed.add(sector, {});
  EXPECT_THAT(packed.holding(BodyId{7}), ElementsAre(sector.sector));
  EXPECT_THAT(packed.holding(BodyId{3}), ElementsAre(sector.sector));
  EXPECT_THAT(packed.holding(BodyId{8}), IsEmpty());
  EXPECT_THAT(packed.touching(BodyId{3}), ElementsAre(sector.sector));
  EXPECT_THAT(packed.touching(BodyId{17}), ElementsAre(sector.sector));
  EXPECT_THAT(packed.touching(BodyId{1'000'000}), IsEmpty());
  EXPECT_TRUE(packed.body(BodyId{7}).has_value());
  EXPECT_FALSE(packed.body(BodyId{3}).has_value()) << "it lives elsewhere";
  packed.take(sector.sector);
  EXPECT_THAT(packed.holding(BodyId{7}), IsEmpty());
}

TEST(PackedSectors, BeginNoContactThatIsThereWhenSomebodyBeginsToAsk) {
  MovedSector sector = sector_at_rest();
  sector.touching.clear();
  PackedSectors packed;
  packed.add(sector, {{BodyId{3}, BodyId{7}}});
  EXPECT_THAT(packed.copy(sector.sector).touching, IsEmpty());
  packed.report_contacts(true);
  EXPECT_EQ(packed.copy(sector.sector).touching.size(), 1u);
  packed.report_contacts(false);
  EXPECT_THAT(packed.copy(sector.sector).touching, IsEmpty());
}

TEST(PropertiesPool, KeepsEqualOnesOnceUntilTheLastIsReleased) {
  PropertiesPool pool;
  BodyProperties heavy;
  heavy.mass = 5;
  const auto first = pool.hold(heavy);
  EXPECT_EQ(pool.hold(heavy), first);
  const auto usual = pool.hold(BodyProperties{});
  EXPECT_NE(usual, first);
  BodyProperties negative;
  negative.centre[0] = -0.0;
  EXPECT_NE(pool.hold(negative), usual) << "other bits";
  pool.release(heavy);
  EXPECT_EQ(pool[first].mass, 5);
  pool.release(heavy);
  EXPECT_EQ(pool.size(), 2u);
}

}  // namespace
}  // namespace tessera
