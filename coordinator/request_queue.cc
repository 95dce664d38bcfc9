#include "coordinator/request_queue.h"

#include <absl/strings/str_cat.h>

#include "proto/status.h"

namespace tessera {

absl::Status RequestQueue::room_locked(std::size_t bytes) const {
  if (closed_) return stands_by_error("the coordinator is shutting down");
  if (requests_.size() >= kQueuedRequestsMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat(requests_.size(), " requests wait, and no more may: ask again later"));
  }
  if (!requests_.empty() && bytes_ + bytes > bytes_max_) {
    return absl::ResourceExhaustedError(absl::StrCat("requests of ", bytes_, " bytes wait, and with ", bytes,
                                                     " more they would exceed ", bytes_max_,
                                                     " (--queued-mib): ask again later"));
  }
  return absl::OkStatus();
}

absl::Status RequestQueue::room_for(std::size_t bytes) const {
  const std::lock_guard lock(mutex_);
  return room_locked(bytes);
}

absl::Status RequestQueue::push(ClientRequest& request, std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (absl::Status status = room_locked(bytes); !status.ok()) return status;
    requests_.push_back(std::move(request));
    bytes_ += bytes;
    if (requests_.size() > 1) return absl::OkStatus();
  }
  wake_();
  return absl::OkStatus();
}

std::vector<ClientRequest> RequestQueue::take() {
  const std::lock_guard lock(mutex_);
  bytes_ = 0;
  return std::exchange(requests_, {});
}

void RequestQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

}  // namespace tessera
