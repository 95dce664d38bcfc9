// Streams of bodies, as filters ask for them.
#pragma once

#include <absl/status/statusor.h>
#include <absl/time/time.h>

#include <memory>

#include "client_sdk/src/subscriber.h"
#include "tessera/stream.h"

namespace tessera {

// Of a filter that follows no body.
absl::StatusOr<std::unique_ptr<BodyStream>> subscribe(const Subscriber& subscriber, const BodyFilter& filter,
                                                      absl::Duration timeout);

// Of one that does.
absl::StatusOr<std::unique_ptr<BodyStream>> subscribe_following(const Subscriber& subscriber,
                                                                const BodyFilter& filter, double sector_size,
                                                                absl::Duration timeout);

}  // namespace tessera
