#include "client_sdk/src/body_subscriptions.h"

#include <utility>

#include "client_sdk/src/body_frames.h"
#include "client_sdk/src/followed_bodies.h"
#include "client_sdk/src/stream_traits.h"
#include "proto/convert.h"

namespace tessera {

absl::StatusOr<std::unique_ptr<BodyStream>> subscribe(const Subscriber& subscriber, const BodyFilter& filter,
                                                      absl::Duration timeout) {
  v1::WatchBodiesRequest request;
  if (filter.region) {
    *request.mutable_region()->mutable_centre() = to_proto(filter.region->centre);
    *request.mutable_region()->mutable_half_size() = to_proto(filter.region->half_size);
  }
  for (const BodyId& id : filter.ids) request.add_ids(id.value);
  request.set_every_ticks(filter.every_ticks);
  request.set_only_awake(filter.only_awake);
  request.set_in_columns(true);
  request.set_precision(filter.precision);
  request.set_velocity_precision(filter.velocity_precision);
  request.set_bytes_per_second(filter.bytes_per_second);
  absl::StatusOr<std::unique_ptr<Stream<BodyNews>>> news = subscriber.watch<BodyTraits>(request, timeout);
  if (!news.ok()) return news.status();
  return std::make_unique<FramesOfBodies>(*std::move(news), filter.complete);
}

absl::StatusOr<std::unique_ptr<BodyStream>> subscribe_following(const Subscriber& subscriber,
                                                                const BodyFilter& filter, double sector_size,
                                                                absl::Duration timeout) {
  if (!filter.region)
    return absl::InvalidArgumentError("follow: it needs a region, whose half_size it takes");
  BodyFilter of_leader = filter;
  of_leader.region.reset();
  of_leader.ids = {*filter.follow};
  of_leader.only_awake = false;
  of_leader.complete = true;
  of_leader.bytes_per_second = 0;  // one body is not too much
  absl::StatusOr<std::unique_ptr<BodyStream>> leader = subscribe(subscriber, of_leader, timeout);
  if (!leader.ok()) return leader.status();
  const auto open = [subscriber, filter, timeout](const WatchedRegion& region) {
    BodyFilter around = filter;
    around.region = region;
    around.complete = true;
    return subscribe(subscriber, around, timeout);
  };
  return FollowedBodies::create(*std::move(leader), filter, sector_size, open, timeout);
}

}  // namespace tessera
