// Opens streams at the servers of a world. A value: streams that open others keep one.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>

#include <algorithm>
#include <memory>
#include <type_traits>
#include <utility>

#include "client_sdk/src/coordinators.h"
#include "client_sdk/src/server_stream.h"
#include "keys/keys_folder.h"
#include "proto/stream_limits.h"
#include "tessera.grpc.pb.h"

namespace tessera {

class Subscriber {
 public:
  Subscriber(ClientKeys keys, std::shared_ptr<Coordinators> coordinators)
      : keys_(std::move(keys)), coordinators_(std::move(coordinators)) {}

  // Waits until all servers that take part have answered. A world that recovers is waited for.
  template <typename Traits>
  absl::StatusOr<std::unique_ptr<Stream<typename Traits::Frame>>> watch(
      const typename Traits::Request& request, absl::Duration timeout) const {
    const absl::Time deadline = absl::Now() + timeout;
    const absl::StatusOr<v1::StatusReply> status = watchable(deadline);
    if (!status.ok()) return status.status();
    const absl::StatusOr<typename Traits::Request> shared = shared_out(request, *status);
    if (!shared.ok()) return shared.status();
    auto stream = std::make_unique<ServerStreams<Traits>>(
        *shared, *status, keys_,
        [coordinators = coordinators_]() -> absl::StatusOr<v1::StatusReply> {
          return coordinators->call(&v1::Tessera::Stub::GetStatus, v1::StatusRequest(), kAskTimeout);
        },
        [coordinators = coordinators_] { return coordinators->address(); });
    if (absl::Status subscribed = stream->wait_for_all(deadline - absl::Now()); !subscribed.ok())
      return subscribed;
    return stream;
  }

 private:
  static constexpr absl::Duration kAskTimeout = absl::Seconds(2);

  // What each server is asked for. INVALID_ARGUMENT.
  template <typename Request>
  static absl::StatusOr<Request> shared_out(Request request, const v1::StatusReply& status) {
    if constexpr (std::is_same_v<Request, v1::WatchBodiesRequest>) {
      const std::uint64_t budget = request.bytes_per_second();
      if (budget == 0) return request;
      std::uint64_t servers = 0;
      for (const v1::ServerStatus& server : status.servers()) servers += server.takes_part() ? 1 : 0;
      if (budget < servers * kBytesPerSecondMin) {
        return absl::InvalidArgumentError(absl::StrCat("bytes_per_second = ", budget,
                                                       " must be 0, or at least ", kBytesPerSecondMin,
                                                       " for each of ", servers, " servers"));
      }
      request.set_bytes_per_second(budget / servers);
    }
    return request;
  }

  // With servers that take part in the world.
  absl::StatusOr<v1::StatusReply> watchable(absl::Time deadline) const {
    for (;;) {
      absl::StatusOr<v1::StatusReply> status =
          coordinators_->call(&v1::Tessera::Stub::GetStatus, v1::StatusRequest(), deadline - absl::Now());
      if (!status.ok()) return status;
      if (status->state() == "empty")
        return absl::FailedPreconditionError("no world is loaded: there is nothing to watch");
      const auto takes_part = [](const v1::ServerStatus& server) { return server.takes_part(); };
      if (std::any_of(status->servers().begin(), status->servers().end(), takes_part)) return status;
      if (status->state() != "recovering" || !Coordinators::is_worth_another(deadline)) {
        return absl::FailedPreconditionError(absl::StrCat(
            "the world is ", status->state(), ": no server takes part in it that could be watched"));
      }
    }
  }

  ClientKeys keys_;
  std::shared_ptr<Coordinators> coordinators_;  // streams have them, too
};

}  // namespace tessera
