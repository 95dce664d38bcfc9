#include "client_sdk/src/followed_bodies.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <vector>

namespace tessera {
namespace {

// What regions have more than what is wanted: of the largest half size, and the way of the body in the time
// that it may take to open another one, s; or so many times its way while the last one was opened; up to so
// many of the largest half size.
constexpr double kMargin = 0.5;
constexpr double kAhead = 1;
constexpr double kWays = 3;
constexpr double kMarginMax = 16;

}  // namespace

absl::StatusOr<std::unique_ptr<BodyStream>> FollowedBodies::create(std::unique_ptr<BodyStream> leader,
                                                                   const BodyFilter& filter,
                                                                   double sector_size, Open open,
                                                                   absl::Duration timeout, std::launch how) {
  const absl::Time deadline = absl::Now() + timeout;
  std::unique_ptr<FollowedBodies> stream(
      new FollowedBodies(std::move(leader), filter, sector_size, std::move(open), how));
  absl::StatusOr<BodyFrame> first = stream->leader_->next(deadline - absl::Now());
  if (!first.ok()) return first.status();
  if (first->bodies.empty())
    return absl::NotFoundError(absl::StrCat("follow: no body has the id ", filter.follow->value));
  stream->place_ = first->bodies.front();
  stream->frame_ = *std::move(first);
  absl::StatusOr<Area> area = stream->opened(stream->around_here());
  if (!area.ok()) return area.status();
  stream->use(*std::move(area));
  return stream;
}

absl::StatusOr<BodyFrame> FollowedBodies::next(absl::Duration timeout) {
  const absl::Time deadline =
      timeout == absl::InfiniteDuration() ? absl::InfiniteFuture() : absl::Now() + timeout;
  for (;;) {
    if (!frame_) {
      absl::StatusOr<BodyFrame> frame = leader_->next(deadline - absl::Now());
      if (!frame.ok()) return frame.status();
      frame_ = *std::move(frame);
      if (!frame_->bodies.empty()) place_ = frame_->bodies.front();
      look_for_next_area();
    }
    change_area_where_ready(frame_->tick);
    if (absl::Status status = read_to(frame_->tick, area_, deadline); !status.ok()) return status;
    if (area_.frame->tick == frame_->tick) return cut();
    ++unmatched_;
    frame_.reset();
  }
}

void FollowedBodies::cancel() {
  leader_->cancel();
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  if (in_use_) in_use_->cancel();
}

std::uint64_t FollowedBodies::skipped() const { return leader_->skipped() + unmatched_; }

FollowedBodies::Around FollowedBodies::around_here() const {
  const Eigen::Vector3d& half_size = filter_.region->half_size;
  const double largest = half_size.maxCoeff();
  const double ahead = std::max(kMargin * largest + kAhead * place_.linear_velocity.norm(), kWays * way_);
  const double margin = std::min(ahead, kMarginMax * largest);
  return {{place_.pose.position, half_size.array() + margin}, margin};
}

Eigen::Vector3d FollowedBodies::away(const WorldPosition& position, const WorldPosition& centre) const {
  return (relative_to(position, centre.sector, sector_size_) - centre.local).cwiseAbs();
}

absl::StatusOr<FollowedBodies::Area> FollowedBodies::opened(const Around& around) const {
  absl::StatusOr<std::unique_ptr<BodyStream>> stream = open_(around.region);
  if (!stream.ok()) return stream.status();
  return Area{around, *std::move(stream), std::nullopt};
}

void FollowedBodies::use(Area area) {
  area_ = std::move(area);
  const std::lock_guard lock(mutex_);
  in_use_ = area_.stream;
  if (cancelled_) in_use_->cancel();
}

absl::Status FollowedBodies::read_to(Tick tick, Area& area, absl::Time deadline) {
  while (!area.frame || area.frame->tick < tick) {
    absl::StatusOr<BodyFrame> frame = area.stream->next(deadline - absl::Now());
    if (!frame.ok()) return frame.status();
    area.frame = *std::move(frame);
  }
  return absl::OkStatus();
}

// A region that cannot be had now is asked for again.
void FollowedBodies::look_for_next_area() {
  if (opening_.valid() || coming_) return;
  const Around& now = area_.around;
  if (away(place_.pose.position, now.region.centre).maxCoeff() <= now.margin / 2) return;
  opened_from_ = place_.pose.position;
  opening_ = std::async(how_, [this, around = around_here()] { return opened(around); });
}

void FollowedBodies::change_area_where_ready(Tick tick) {
  if (opening_.valid() && opening_.wait_for(std::chrono::seconds(0)) != std::future_status::timeout) {
    if (absl::StatusOr<Area> area = opening_.get(); area.ok()) coming_ = *std::move(area);
  }
  if (!coming_) return;
  const absl::Status status = read_to(tick, *coming_, absl::Now());
  if (absl::IsDeadlineExceeded(status)) return;
  if (!status.ok()) {
    coming_.reset();
  } else if (coming_->frame->tick == tick && is_better(*coming_)) {
    way_ = away(place_.pose.position, opened_from_).maxCoeff();
    use(*std::exchange(coming_, std::nullopt));
  }
}

// With a budget, a stream has all bodies of its region after some ticks. It is used before where the present
// one lacks more, since what is wanted reaches beyond its region.
bool FollowedBodies::is_better(const Area& area) const {
  return area.frame->deferred == 0 ||
         away(place_.pose.position, area_.around.region.centre).maxCoeff() > area_.around.margin;
}

// What is in the exact box.
BodyFrame FollowedBodies::cut() {
  std::vector<BodySample> bodies;
  const auto is_leader = [&](const BodySample& body) { return body.id == *filter_.follow; };
  std::copy_if(area_.frame->bodies.begin(), area_.frame->bodies.end(), std::back_inserter(bodies),
               [&](const BodySample& body) {
                 const Eigen::Vector3d from_leader = away(body.pose.position, place_.pose.position);
                 return !is_leader(body) && (from_leader.array() <= filter_.region->half_size.array()).all();
               });
  const auto place = std::find_if(bodies.begin(), bodies.end(),
                                  [&](const BodySample& body) { return *filter_.follow < body.id; });
  bodies.insert(place, frame_->bodies.begin(), frame_->bodies.end());
  BodyFrame shown = shown_.replace(frame_->tick, bodies);
  shown.deferred = area_.frame->deferred;
  frame_.reset();
  return shown;
}

}  // namespace tessera
