// What the next version reads of what this one has stored: structs with a field more stand for it.
#include "lpss/base/since.h"

#include <gtest/gtest.h>

#include <optional>
#include <variant>
#include <vector>

#include "proto/archive.h"
#include "proto/wire.h"

namespace tessera {
namespace {

constexpr std::uint32_t kNext = kStoredVersion + 1;

struct Lamp {
  double power = 1;
  bool is_on = false;

  bool operator==(const Lamp&) const = default;
};
struct NextLamp {
  double power = 1;
  std::uint32_t colour = 7;  // that lamps of this version have, without knowing it
  bool is_on = false;

  bool operator==(const NextLamp&) const = default;
};

template <typename Archive, Is<Lamp> T>
void describe(Archive& archive, T& x) {
  archive(x.power, x.is_on);
}
template <typename Archive, Is<NextLamp> T>
void describe(Archive& archive, T& x) {
  archive(x.power, since(kNext, x.colour), x.is_on);
}

// As stored things are: in lists, options and alternatives, with something behind them.
template <typename AnyLamp>
struct House {
  std::vector<AnyLamp> lamps;
  std::optional<AnyLamp> spare;
  std::variant<std::uint64_t, AnyLamp> door;
  std::uint64_t number = 0;

  bool operator==(const House&) const = default;
};
template <typename Archive, typename T>
requires Is<T, House<Lamp>> || Is<T, House<NextLamp>>
void describe(Archive& archive, T& x) { archive(x.lamps, x.spare, x.door, x.number); }

const House<Lamp> kHouse{{{3, true}, {4, false}}, Lamp{5, true}, Lamp{6, false}, 12};

absl::StatusOr<House<NextLamp>> read(const std::string& bytes, std::uint32_t version) {
  return unpack_struct<House<NextLamp>>(bytes, version, "a house");
}

TEST(Since, AFieldThatTheVersionDidNotHaveIsADefaultEverywhere) {
  const auto next = read(pack_struct(kHouse), kStoredVersion);
  ASSERT_TRUE(next.ok()) << next.status();
  const House<NextLamp> expected{
      {{3, 7, true}, {4, 7, false}}, NextLamp{5, 7, true}, NextLamp{6, 7, false}, 12};
  EXPECT_EQ(*next, expected);
}

TEST(Since, AFieldOfTheVersionItselfIsRead) {
  const House<NextLamp> house{{{3, 1, true}, {4, 2, false}}, std::nullopt, NextLamp{6, 3, false}, 12};
  const auto again = read(pack_struct(house), kNext);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(*again, house);
}

TEST(Since, BytesOfOneVersionDoNotFitTheOther) {
  EXPECT_EQ(read(pack_struct(kHouse), kNext).status().code(), absl::StatusCode::kDataLoss);
  const std::string next = pack_struct(House<NextLamp>{{{3, 1, true}}, {}, {}, 12});
  EXPECT_EQ(read(next, kStoredVersion).status().code(), absl::StatusCode::kDataLoss);
}

// So a build that has the field cannot keep the number: Wire.WhatIsStoredHasAVersion compares this text.
TEST(Since, TheOutlineChangesWithTheField) {
  EXPECT_NE(outline_of<House<Lamp>>(), outline_of<House<NextLamp>>());
}

}  // namespace
}  // namespace tessera
