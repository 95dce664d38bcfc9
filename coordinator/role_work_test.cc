#include "coordinator/role_work.h"

#include <gmock/gmock.h>

#include "coordinator/limits.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr ClientRole kObserve = ClientRole::kObserve;
constexpr double kShare = 0.2;

// A client that asks as soon as it may, with requests of 7 ms.
TEST(RoleWorkTest, ObserversTakeNoMoreThanTheirShareOfAnySpanOfTime) {
  RoleWork work(kShare);
  RoleWork::Nanoseconds taken{};
  RoleWork::Nanoseconds now{};
  for (; now < std::chrono::seconds(10); now += milliseconds(1)) {
    if (!work.admit(kObserve, true, now).ok()) continue;
    work.add_work(kObserve, milliseconds(7), true);
    taken += milliseconds(7);
  }
  const auto share = static_cast<double>(taken.count()) / static_cast<double>(now.count());
  EXPECT_LE(share, kShare + 0.02);  // what was saved up at the beginning, and the last request
  EXPECT_GT(share, 0.95 * kShare);
  EXPECT_EQ(work.costs()[0].work, taken);
  EXPECT_EQ(work.costs()[0].requests, 10'000u);
  EXPECT_EQ(work.costs()[0].requests - work.costs()[0].refused,
            static_cast<std::uint64_t>(taken / milliseconds(7)));
}

TEST(RoleWorkTest, WhoIsRefusedLearnsTheShareAndWhenToAskAgain) {
  RoleWork work(kShare);
  ASSERT_TRUE(work.admit(kObserve, true, milliseconds(0)).ok());
  const auto saved = std::chrono::duration_cast<RoleWork::Nanoseconds>(kShare * kObserveSavedMax);
  work.add_work(kObserve, saved + milliseconds(100), true);
  const absl::Status refused = work.admit(kObserve, true, milliseconds(0));
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), HasSubstr("20 % (--observe-share): ask again in 500 ms"));
  EXPECT_FALSE(work.admit(kObserve, true, milliseconds(499)).ok());
  EXPECT_TRUE(work.admit(kObserve, true, milliseconds(500)).ok());
}

TEST(RoleWorkTest, AWorldThatStandsStillHasTimeForAll) {
  RoleWork work(kShare);
  for (int n = 0; n < 10; ++n) {
    EXPECT_TRUE(work.admit(kObserve, false, milliseconds(n)).ok());
    work.add_work(kObserve, std::chrono::seconds(1), false);
  }
  EXPECT_TRUE(work.admit(kObserve, true, milliseconds(10)).ok()) << "none of which counts once it ticks";
}

TEST(RoleWorkTest, OtherRolesAreCountedAndNotRefused) {
  RoleWork work(kShare);
  for (int n = 0; n < 3; ++n) {
    EXPECT_TRUE(work.admit(ClientRole::kControl, true, milliseconds(n)).ok());
    work.add_work(ClientRole::kControl, std::chrono::seconds(1), true);
  }
  EXPECT_TRUE(work.admit(kObserve, true, milliseconds(3)).ok());
  const RoleWork::Costs& control = work.costs()[static_cast<std::size_t>(ClientRole::kControl)];
  EXPECT_EQ(control.requests, 3u);
  EXPECT_EQ(control.refused, 0u);
  EXPECT_EQ(control.work, std::chrono::seconds(3));
}

}  // namespace
}  // namespace tessera
