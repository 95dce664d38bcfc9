#include "coordinator/tick_statistics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/model/limits.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"

namespace tessera {
namespace {

// Values below 2^kBits have a bucket each; every doubling above has 2^kBits.
constexpr int kBits = 7;

std::size_t bucket_of(std::uint64_t value) {
  const int doublings = std::max(0, static_cast<int>(std::bit_width(value)) - kBits - 1);
  return (static_cast<std::size_t>(doublings) << kBits) + static_cast<std::size_t>(value >> doublings);
}

// The middle of a bucket.
double value_of(std::size_t bucket) {
  const std::size_t doublings = bucket < (std::size_t{2} << kBits) ? 0 : (bucket >> kBits) - 1;
  const std::size_t mantissa = bucket - (doublings << kBits);
  const double width = std::ldexp(1, static_cast<int>(doublings));
  return static_cast<double>(mantissa) * width + (width - 1) / 2;
}

constexpr std::chrono::nanoseconds kMeterSpan = std::chrono::seconds(2);
constexpr std::chrono::nanoseconds kMeterGap = std::chrono::milliseconds(50);

// A server is slow if its own part of ticks is so many times that of any other, and of this length.
constexpr double kSlowFactor = 2;
constexpr double kSlowEndFactor = 1.5;
constexpr double kSlowMinUs = 1000;
constexpr double kOwnWeight = 1.0 / 64;  // of a tick in the mean of the last ones
constexpr std::uint64_t kSlowTicksMin = 64;

// Ticks reported by some servers only; larger than any window of grants.
constexpr std::size_t kPartialTicksMax = 65'536;

// Of servers; reports of ticks before these do not come any more.
constexpr std::size_t kChangesKept = 256;

// Older ones than these were complete, too.
constexpr std::size_t kWholeTicksMax = 16'384;

}  // namespace

void DurationHistogram::add(std::uint64_t microseconds) {
  const std::size_t bucket = bucket_of(microseconds);
  if (bucket >= buckets_.size()) buckets_.resize(bucket + 1);
  ++buckets_[bucket];
  ++count_;
  sum_us_ += microseconds;
  max_us_ = std::max(max_us_, microseconds);
}

TickTimes DurationHistogram::times() const {
  return {.mean = count_ == 0 ? 0 : static_cast<double>(sum_us_) / static_cast<double>(count_) / 1e3,
          .p50 = quantile_ms(0.5),
          .p99 = quantile_ms(0.99),
          .max = max_ms()};
}

double DurationHistogram::quantile_ms(double share) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket < buckets_.size(); ++bucket) {
    seen += buckets_[bucket];
    if (seen > 0 && seen >= wanted) return std::min(value_of(bucket) / 1e3, max_ms());
  }
  return 0;
}

void TickStatistics::restart(std::span<const NodeId> servers) {
  servers_.clear();
  counts_.clear();
  partial_.clear();
  change_servers(0, servers);
}

void TickStatistics::change_servers(Tick since, std::span<const NodeId> servers) {
  invariant(servers.size() <= kServersMax, "a world has at most kServersMax servers");
  std::map<NodeId, OfServer> before = std::exchange(servers_, {});
  for (const NodeId server : servers) servers_[server] = std::move(before[server]);
  counts_[since] = servers.size();
  if (counts_.size() > kChangesKept) counts_.erase(counts_.begin());
  ticks_since_restart_ = 0;
  slow_.reset();
}

std::size_t TickStatistics::servers_at(Tick tick) const {
  const auto after = counts_.upper_bound(tick);
  return after == counts_.begin() ? after->second : std::prev(after)->second;
}

std::optional<TickSums> TickStatistics::add(NodeId from, const v1::TickReport& report) {
  OfServer one_that_has_left;
  const auto found = servers_.find(from);
  OfServer& server = found == servers_.end() ? one_that_has_left : found->second;
  if (report.tick() > server.last.tick()) server.last = report;
  const bool was_whole =
      whole_.contains(report.tick()) || (whole_.size() == kWholeTicksMax && report.tick() < *whole_.begin());
  if (was_whole) return std::nullopt;
  if (partial_.size() >= kPartialTicksMax) partial_.erase(partial_.begin());
  TickSums& sums = partial_[report.tick()];
  if (std::find(sums.heard_from.begin(), sums.heard_from.end(), from) != sums.heard_from.end())
    return std::nullopt;
  sums.heard_from.push_back(from);

  server.durations.add(report.work_us());
  server.own_us += kOwnWeight * (static_cast<double>(report.own_us()) - server.own_us);
  sums.tick = report.tick();
  sums.work_us = std::max(sums.work_us, report.work_us());
  sums.counts += counts_from(report.counts());
  sums.hash.add(WorldHash(report.hash_low(), report.hash_high()));
  sums.programs.add(WorldHash(report.programs_low(), report.programs_high()));
  for (const v1::Divergence& divergence : report.divergences()) {
    if (sums.divergences.size() >= kDivergencesKept * servers_at(report.tick())) break;
    sums.divergences.push_back(from_proto(divergence));
  }
  if (sums.heard_from.size() < servers_at(report.tick())) return std::nullopt;
  const TickSums whole = sums;
  partial_.erase(report.tick());
  complete(whole);
  return whole;
}

void TickStatistics::look_for_slow() {
  if (servers_.size() < 2 || ++ticks_since_restart_ < kSlowTicksMin) return;
  const auto less = [](const auto& a, const auto& b) { return a.second.own_us < b.second.own_us; };
  const auto slowest = std::max_element(servers_.begin(), servers_.end(), less);
  double next_us = 0;
  bool has_all_work = true;
  for (auto server = servers_.begin(); server != servers_.end(); ++server) {
    if (server == slowest) continue;
    next_us = std::max(next_us, server->second.own_us);
    if (counts_from(server->second.last.counts()).sectors_awake > 0) has_all_work = false;
  }
  const double factor = slow_ == slowest->first ? kSlowEndFactor : kSlowFactor;
  const bool is_slow = !has_all_work && slowest->second.own_us >= std::max(kSlowMinUs, factor * next_us);
  slow_ = is_slow ? std::optional(slowest->first) : std::nullopt;
}

void TickStatistics::complete(const TickSums& sums) {
  look_for_slow();
  if (whole_.size() == kWholeTicksMax) whole_.erase(whole_.begin());
  whole_.insert(sums.tick);
  durations_.add(sums.work_us);
  counts_since_load_.add_tick(sums.counts);
  if (sums.tick > last_.tick) last_ = sums;
  // Ticks are complete in their order, so that the first ones are the same on any number of servers.
  divergences_.insert(divergences_.end(), sums.divergences.begin(), sums.divergences.end());
  std::sort(divergences_.begin(), divergences_.end());
  divergences_.resize(first_divergences(divergences_).size());
}

void RealTimeMeter::start(Tick tick, Nanoseconds now) {
  started_ = Mark{tick, now};
  stopped_.reset();
  marks_ = {*started_};
  tick_ = tick;
}

void RealTimeMeter::progress(Tick tick, Nanoseconds now) {
  if (!started_ || stopped_ || tick == tick_) return;
  tick_ = tick;
  if (now - marks_.back().time >= kMeterGap) marks_.push_back({tick, now});
  while (marks_.size() > 1 && marks_[1].time <= now - kMeterSpan) marks_.pop_front();
}

void RealTimeMeter::stop(Tick tick, Nanoseconds now) {
  if (started_ && !stopped_) stopped_ = Mark{tick, now};
}

double RealTimeMeter::factor(double time_step, Nanoseconds now) const {
  if (!started_) return 0;
  const Mark& from = stopped_ ? *started_ : marks_.front();
  const Mark to = stopped_.value_or(Mark{tick_, now});
  const double seconds = std::chrono::duration<double>(to.time - from.time).count();
  return seconds <= 0 ? 0 : static_cast<double>(to.tick - from.tick) * time_step / seconds;
}

}  // namespace tessera
