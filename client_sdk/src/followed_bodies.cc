#include "client_sdk/src/followed_bodies.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <vector>

namespace tessera {
namespace {

// Of the largest half size: what regions have more than what is wanted.
constexpr double kMargin = 0.5;

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
  absl::StatusOr<Area> area = stream->opened(stream->region_here());
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

WatchedRegion FollowedBodies::region_here() const {
  const Eigen::Vector3d& half_size = filter_.region->half_size;
  return {place_.pose.position, half_size.array() + kMargin * half_size.maxCoeff()};
}

Eigen::Vector3d FollowedBodies::away(const WorldPosition& position, const WorldPosition& centre) const {
  return (relative_to(position, centre.sector, sector_size_) - centre.local).cwiseAbs();
}

absl::StatusOr<FollowedBodies::Area> FollowedBodies::opened(const WatchedRegion& region) const {
  absl::StatusOr<std::unique_ptr<BodyStream>> stream = open_(region);
  if (!stream.ok()) return stream.status();
  return Area{region, *std::move(stream), std::nullopt};
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
  const double margin = kMargin * filter_.region->half_size.maxCoeff();
  if (away(place_.pose.position, area_.region.centre).maxCoeff() <= margin / 2) return;
  opening_ = std::async(how_, [this, region = region_here()] { return opened(region); });
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
  } else if (coming_->frame->tick == tick) {
    use(*std::exchange(coming_, std::nullopt));
  }
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
  const Tick tick = frame_->tick;
  frame_.reset();
  return shown_.replace(tick, bodies);
}

}  // namespace tessera
