#include "coordinator/request_queue.h"

#include <absl/strings/str_cat.h>

#include "proto/status.h"

namespace tessera {

absl::Status RequestQueue::room_locked(std::size_t bytes, const std::string& client) const {
  if (closed_) return stands_by_error("the coordinator is shutting down");
  if (count_ >= kQueuedRequestsMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat(count_, " requests wait, and no more may: ask again later"));
  }
  const auto own = waiting_.find(client);
  if (!client.empty() && own != waiting_.end() && own->second.size() >= kQueuedRequestsPerClientMax) {
    return absl::ResourceExhaustedError(absl::StrCat(
        own->second.size(), " requests of this connection wait, and no more may: ask again later"));
  }
  if (count_ > 0 && bytes_ + bytes > bytes_max_) {
    return absl::ResourceExhaustedError(absl::StrCat("requests of ", bytes_, " bytes wait, and with ", bytes,
                                                     " more they would exceed ", bytes_max_,
                                                     " (--queued-mib): ask again later"));
  }
  return absl::OkStatus();
}

absl::Status RequestQueue::room_for(std::size_t bytes, const std::string& client) const {
  const std::lock_guard lock(mutex_);
  return room_locked(bytes, client);
}

absl::Status RequestQueue::push(ClientRequest& request, std::size_t bytes, const std::string& client) {
  {
    const std::lock_guard lock(mutex_);
    if (absl::Status status = room_locked(bytes, client); !status.ok()) return status;
    std::deque<Waiting>& own = waiting_[client];
    if (own.empty()) turns_.push_back(client);
    own.push_back({std::move(request), bytes});
    bytes_ += bytes;
    if (++count_ > 1) return absl::OkStatus();
  }
  wake_();
  return absl::OkStatus();
}

std::optional<ClientRequest> RequestQueue::take_next() {
  const std::lock_guard lock(mutex_);
  if (turns_.empty()) return std::nullopt;
  const auto own = waiting_.find(turns_.front());
  turns_.pop_front();
  Waiting next = std::move(own->second.front());
  own->second.pop_front();
  if (own->second.empty()) {
    waiting_.erase(own);
  } else {
    turns_.push_back(own->first);
  }
  --count_;
  bytes_ -= next.bytes;
  return std::move(next.request);
}

std::vector<ClientRequest> RequestQueue::take() {
  std::vector<ClientRequest> all;
  while (std::optional<ClientRequest> next = take_next()) all.push_back(*std::move(next));
  return all;
}

bool RequestQueue::is_empty() const {
  const std::lock_guard lock(mutex_);
  return count_ == 0;
}

void RequestQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

}  // namespace tessera
