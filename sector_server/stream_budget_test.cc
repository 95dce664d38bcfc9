#include "sector_server/stream_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <utility>

#include "proto/stream_limits.h"

namespace tessera {
namespace {

using BudgetTime = StreamBudget::Time;

constexpr std::chrono::microseconds kTickOfStream{16'667};

// The most that was sent within a second, and how many bodies in all.
struct Sent {
  std::size_t bytes_max = 0;
  std::size_t bodies = 0;
};

// Of a stream that always has more to tell, at `body_bytes` each.
Sent send_all(std::uint64_t rate, std::size_t body_bytes, int ticks) {
  BudgetTime now{};
  StreamBudget budget(rate, now);
  std::deque<std::pair<BudgetTime, std::size_t>> second;
  std::size_t bytes_in_second = 0;
  Sent sent;
  for (int tick = 0; tick < ticks; ++tick, now += kTickOfStream) {
    const std::size_t bodies = budget.bodies(now);
    const std::size_t bytes = 50 + bodies * body_bytes;
    budget.sent(budget.reserve(bodies), bytes, bodies);
    second.emplace_back(now, bytes);
    bytes_in_second += bytes;
    while (second.front().first <= now - std::chrono::seconds(1)) {
      bytes_in_second -= second.front().second;
      second.pop_front();
    }
    sent.bytes_max = std::max(sent.bytes_max, bytes_in_second);
    sent.bodies += bodies;
  }
  return sent;
}

TEST(StreamBudget, NoSecondHasMoreThanTheBudgetAndMostOfItIsUsed) {
  for (const std::uint64_t rate : {20'000, 100'000, 10'000'000}) {
    for (const std::size_t body_bytes : {8, 24, 114, 160}) {
      const Sent sent = send_all(rate, body_bytes, 600);
      EXPECT_LE(sent.bytes_max, rate) << rate << " " << body_bytes;
      EXPECT_GE(sent.bytes_max, 3 * rate / 4) << rate << " " << body_bytes;
    }
  }
}

TEST(StreamBudget, OneBodyIsToldWhateverItTakesAndPaidForLater) {
  BudgetTime now{};
  StreamBudget budget(kBytesPerSecondMin, now);
  EXPECT_GE(budget.bodies(now), 1u);
  budget.sent(budget.reserve(1), 5000, 1);
  EXPECT_EQ(budget.bodies(now), 1u);
  // The rest of the second goes by before there is room for more.
  for (int tick = 0; tick < 30; ++tick) EXPECT_EQ(budget.bodies(now += kTickOfStream), 1u);
}

TEST(StreamBudget, WithoutOneAllAreTold) {
  StreamBudget budget(0, BudgetTime{});
  EXPECT_EQ(budget.bodies(BudgetTime{}), StreamBudget::kAll);
}

TEST(StreamBudget, HasBounds) {
  v1::WatchBodiesRequest request;
  EXPECT_TRUE(check_budget(request).ok());
  for (const std::uint64_t rate : {kBytesPerSecondMin, kBytesPerSecondMax}) {
    request.set_bytes_per_second(rate);
    EXPECT_TRUE(check_budget(request).ok());
  }
  for (const std::uint64_t rate : {kBytesPerSecondMin - 1, kBytesPerSecondMax + 1}) {
    request.set_bytes_per_second(rate);
    EXPECT_EQ(check_budget(request).code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(check_budget(request).message()), testing::HasSubstr("bytes_per_second"));
  }
}

}  // namespace
}  // namespace tessera
