// Packed bodies are off by no more than was asked for, and take few bytes.
#include "proto/packed_bodies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tessera {
namespace {

constexpr double kSectorSize = 128;

class Packing : public testing::Test {
 protected:
  double uniform(double max) { return std::uniform_real_distribution<double>(-max, max)(random_); }
  Eigen::Vector3d vector(double max) { return {uniform(max), uniform(max), uniform(max)}; }
  Eigen::Quaterniond turn() {
    return Eigen::Quaterniond(
        Eigen::Vector4d(normal_(random_), normal_(random_), normal_(random_), normal_(random_)).normalized());
  }

  BodyRow body(std::uint64_t id, double size = kSectorSize) {
    const auto sector = [&] { return static_cast<std::int64_t>(random_() % 3) - (std::int64_t{1} << 62); };
    BodyRow result;
    result.id = BodyId{id};
    result.pose = {{{sector(), sector(), sector()}, vector(size / 2)}, turn()};
    result.linear_velocity = vector(50);
    result.angular_velocity = vector(20);
    result.asleep = random_() % 2 == 0;
    return result;
  }

  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
};

std::vector<BodyRow> unpacked(BodyUnpacker& unpacker, const v1::PackedBodies& packed) {
  std::vector<BodyRow> bodies;
  const absl::Status status = unpacker.read(packed, [&](const BodyRow& body) { bodies.push_back(body); });
  EXPECT_TRUE(status.ok()) << status;
  return bodies;
}

v1::PackedBodies packed_of(BodyPacker& packer, const std::vector<BodyRow>& bodies) {
  v1::PackedBodies packed;
  packer.begin();
  for (const BodyRow& body : bodies) packer.add(body, packed);
  return packed;
}

void expect_near(const BodyRow& is, const BodyRow& was, const PackedPrecision& precision) {
  constexpr double kRounding = 1 + 1e-6;
  ASSERT_EQ(is.id, was.id);
  EXPECT_EQ(is.asleep, was.asleep);
  ASSERT_EQ(is.pose.position.sector, was.pose.position.sector);
  EXPECT_LE((is.pose.position.local - was.pose.position.local).norm(), precision.position * kRounding);
  EXPECT_NEAR(is.pose.orientation.norm(), 1, 1e-12);
  EXPECT_LE(is.pose.orientation.angularDistance(was.pose.orientation),
            std::min(precision.position, 0.1) + 1e-7);
  EXPECT_LE((is.linear_velocity - was.linear_velocity).norm(), precision.velocity * kRounding);
  EXPECT_LE((is.angular_velocity - was.angular_velocity).norm(), precision.velocity * kRounding);
}

// Some jump, some stay, some come and go.
TEST_F(Packing, ErrorsStayBelowWhatWasAskedFor) {
  for (const PackedPrecision& precision : {PackedPrecision{1e-3, 1e-2}, PackedPrecision{1e-6, 1e-6},
                                           PackedPrecision{1, 1000}, PackedPrecision{0.05, 0.1}}) {
    BodyPacker packer(precision);
    BodyUnpacker unpacker(precision);
    std::vector<BodyRow> bodies;
    for (std::uint64_t id = 1; id <= 50; ++id) bodies.push_back(body(id * id));
    for (int batch = 0; batch < 100; ++batch) {
      std::vector<BodyRow> some;
      for (BodyRow& each : bodies) {
        if (random_() % 3 == 0) continue;
        if (random_() % 4 == 0) each = body(each.id.value);
        each.pose.position.local += vector(0.1);
        if (random_() % 20 == 0) {
          packer.forget(each.id);
          unpacker.forget(each.id);
        }
        some.push_back(each);
      }
      const std::vector<BodyRow> told = unpacked(unpacker, packed_of(packer, some));
      ASSERT_EQ(told.size(), some.size());
      for (std::size_t n = 0; n < some.size(); ++n) expect_near(told[n], some[n], precision);
    }
  }
}

TEST_F(Packing, OrientationsNearTheEdgesOfTheirRangeAreNear) {
  const PackedPrecision precision{0.1, 0};
  const double half = 0.5;
  const double edge = std::sqrt(0.5);
  for (const Eigen::Vector4d& q :
       {Eigen::Vector4d(half, half, half, half), Eigen::Vector4d(-half, half, -half, half),
        Eigen::Vector4d(edge, -edge, 0, 0), Eigen::Vector4d(0, 0, edge, edge),
        Eigen::Vector4d(0, 0, 0, -1)}) {
    for (int n = 0; n < 200; ++n) {
      BodyRow turned;
      turned.id = BodyId{1};
      turned.pose.orientation =
          Eigen::Quaterniond(Eigen::Vector4d(q + 0.03 * Eigen::Vector4d(turn().coeffs())).normalized());
      BodyPacker packer(precision);
      BodyUnpacker unpacker(precision);
      expect_near(unpacked(unpacker, packed_of(packer, {turned})).at(0), turned, precision);
    }
  }
}

TEST_F(Packing, LargeSectorsAreHeld) {
  const PackedPrecision precision{1e-3, 0};
  BodyPacker packer(precision);
  BodyUnpacker unpacker(precision);
  BodyRow far = body(1, 1e9);
  far.linear_velocity.setZero();
  far.angular_velocity.setZero();
  expect_near(unpacked(unpacker, packed_of(packer, {far})).at(0), far, precision);
}

// A ball that falls, rolls and spins, at 60 Hz.
TEST_F(Packing, ABodyInMotionTakesTwentyBytesAtMost) {
  constexpr int kBodies = 1000;
  constexpr double kDt = 1.0 / 60;
  BodyPacker packer({1e-3, 0});
  BodyUnpacker unpacker({1e-3, 0});
  std::vector<BodyRow> bodies;
  for (std::uint64_t id = 1; id <= kBodies; ++id) {
    bodies.push_back(body(id));
    bodies.back().pose.position.sector = {};
  }
  const auto bytes_each = [&] {
    return static_cast<double>(packed_of(packer, bodies).ByteSizeLong()) / kBodies;
  };
  EXPECT_LE(bytes_each(), 20) << "the first time";
  double mean = 0;
  for (int tick = 0; tick < 60; ++tick) {
    for (BodyRow& each : bodies) {
      each.pose.position.local += kDt * each.linear_velocity;
      each.linear_velocity.z() -= 9.81 * kDt;
      const Eigen::Vector3d spin = kDt * each.angular_velocity;
      each.pose.orientation = Eigen::AngleAxisd(spin.norm(), spin.normalized()) * each.pose.orientation;
    }
    const double now = bytes_each();
    EXPECT_LE(now, 20);
    mean += now / 60;
  }
  EXPECT_LE(mean, 12);
  RecordProperty("bytes_a_body_in_hundredths", static_cast<int>(100 * mean));
}

TEST_F(Packing, BytesThatAreNoBatchAreRefused) {
  BodyPacker packer({1e-3, 1e-2});
  std::vector<BodyRow> bodies;
  for (std::uint64_t id = 1; id <= 5; ++id) bodies.push_back(body(id));
  packed_of(packer, bodies);
  const v1::PackedBodies second = packed_of(packer, bodies);
  const auto status_of = [](const v1::PackedBodies& packed) {
    BodyUnpacker unpacker({1e-3, 1e-2});
    return unpacker.read(packed, [](const BodyRow&) {});
  };
  EXPECT_EQ(status_of(second).code(), absl::StatusCode::kDataLoss) << "it refers to another one";
  BodyPacker anew({1e-3, 1e-2});
  const v1::PackedBodies first = packed_of(anew, bodies);
  EXPECT_TRUE(status_of(first).ok());
  for (std::size_t length = 0; length < first.bodies().size(); ++length) {
    v1::PackedBodies cut = first;
    cut.mutable_bodies()->resize(length);
    (void)status_of(cut);
    cut = first;
    (*cut.mutable_bodies())[length] = static_cast<char>(0xff);
    (void)status_of(cut);
  }
  v1::PackedBodies without = first;
  without.clear_sectors();
  EXPECT_EQ(status_of(without).code(), absl::StatusCode::kDataLoss);
}

TEST(PackedPrecision, HasBounds) {
  EXPECT_TRUE(check(PackedPrecision{1e-3, 0}).ok());
  EXPECT_EQ(check(PackedPrecision{2, 0}).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(check(PackedPrecision{0, 0.1}).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(check(PackedPrecision{std::nan(""), 0}).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(check(PackedPrecision{1e-3, -1}).code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace tessera
