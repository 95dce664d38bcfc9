// The region goes with the body: no tick is lost, and nothing comes twice, when one stream takes the place of
// another.
#include "client_sdk/src/followed_bodies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace tessera {
namespace {

constexpr double kSectorOfWalk = 16;
constexpr std::uint64_t kWalker = 1000;
constexpr absl::Duration kAtOnce = absl::ZeroDuration();

// Bodies at rest at each metre along x, by their number from 1; one walks along them.
struct Row {
  Tick tick = 0;
  int opened = 0;
  double speed = 0.5;  // m a tick

  WorldPosition at(double x) const {
    const double sector = std::floor(x / kSectorOfWalk + 0.5);
    return {{static_cast<std::int64_t>(sector), 0, 0}, {x - sector * kSectorOfWalk, 0, 0}};
  }
  BodySample walker(Tick now) const {
    BodySample body;
    body.id = BodyId{kWalker};
    body.pose.position = at(speed * static_cast<double>(now));
    return body;
  }
};

// A complete stream of the row up to its present tick, from that on.
class RowStream final : public BodyStream {
 public:
  RowStream(Row& row, std::optional<WatchedRegion> region)
      : row_(row), region_(std::move(region)), next_(row.tick) {}

  absl::StatusOr<BodyFrame> next(absl::Duration) override {
    if (next_ > row_.tick) return absl::DeadlineExceededError("later");
    BodyFrame frame;
    frame.tick = next_++;
    const BodySample walker = row_.walker(frame.tick);
    if (!region_) {
      frame.bodies = {walker};
      return frame;
    }
    const auto consider = [&](const BodySample& body) {
      const WorldPosition& centre = region_->centre;
      const double away =
          relative_to(body.pose.position, centre.sector, kSectorOfWalk).x() - centre.local.x();
      if (std::abs(away) <= region_->half_size.x()) frame.bodies.push_back(body);
    };
    for (std::uint64_t id = 1; id <= 100; ++id) {
      BodySample body;
      body.id = BodyId{id};
      body.pose.position = row_.at(static_cast<double>(id));
      body.asleep = true;
      consider(body);
    }
    consider(walker);
    return frame;
  }
  void cancel() override {}
  std::uint64_t skipped() const override { return 0; }

 private:
  Row& row_;
  const std::optional<WatchedRegion> region_;
  Tick next_;
};

std::unique_ptr<BodyStream> following(Row& row, bool complete) {
  BodyFilter filter;
  filter.follow = BodyId{kWalker};
  filter.region = {{.centre = {}, .half_size = {4, 4, 4}}};
  filter.complete = complete;
  const auto open = [&row](const WatchedRegion& region) -> absl::StatusOr<std::unique_ptr<BodyStream>> {
    ++row.opened;
    return std::make_unique<RowStream>(row, region);
  };
  return FollowedBodies::create(std::make_unique<RowStream>(row, std::nullopt), filter, kSectorOfWalk, open,
                                kAtOnce, std::launch::deferred)
      .value();
}

TEST(FollowedBodies, AreThoseAroundTheBodyAtEachTick) {
  Row row;
  const std::unique_ptr<BodyStream> stream = following(row, /*complete=*/true);
  for (Tick tick = 0; tick < 150; ++tick) {
    row.tick = tick;
    const absl::StatusOr<BodyFrame> frame = stream->next(kAtOnce);
    ASSERT_TRUE(frame.ok()) << frame.status();
    ASSERT_EQ(frame->tick, tick);
    std::vector<std::uint64_t> expected;
    const double x = row.speed * static_cast<double>(tick);
    for (std::uint64_t id = 1; id <= 100; ++id) {
      if (std::abs(static_cast<double>(id) - x) <= 4) expected.push_back(id);
    }
    expected.push_back(kWalker);
    std::vector<std::uint64_t> ids;
    for (const BodySample& body : frame->bodies) ids.push_back(body.id.value);
    ASSERT_EQ(ids, expected) << "tick " << tick;
  }
  EXPECT_GT(row.opened, 20);
  EXPECT_EQ(stream->skipped(), 0u);
}

TEST(FollowedBodies, ComeAndGoOnceEach) {
  Row row;
  row.speed = 0.125;
  const std::unique_ptr<BodyStream> stream = following(row, /*complete=*/false);
  std::vector<std::uint64_t> come;
  std::vector<std::uint64_t> gone;
  for (Tick tick = 0; tick < 160; ++tick) {
    row.tick = tick;
    const BodyFrame frame = stream->next(kAtOnce).value();
    for (const BodySample& body : frame.bodies) {
      if (body.id.value != kWalker) come.push_back(body.id.value);
    }
    for (const BodyId id : frame.gone) gone.push_back(id.value);
  }
  std::vector<std::uint64_t> expected;
  for (std::uint64_t id = 1; id <= 23; ++id) expected.push_back(id);
  EXPECT_EQ(come, expected);
  expected.resize(15);
  EXPECT_EQ(gone, expected);
}

TEST(FollowedBodies, WaitForTicksThatOneStreamHasYetToTell) {
  Row row;
  const std::unique_ptr<BodyStream> stream = following(row, false);
  EXPECT_TRUE(stream->next(kAtOnce).ok());
  EXPECT_TRUE(absl::IsDeadlineExceeded(stream->next(kAtOnce).status()));
  row.tick = 1;
  EXPECT_EQ(stream->next(kAtOnce)->tick, 1u);
}

}  // namespace
}  // namespace tessera
