#include "coordinator/request_queue.h"

#include "coordinator/limits.h"

namespace tessera {

bool RequestQueue::push(ClientRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || requests_.size() >= kQueuedRequestsMax) return false;
    requests_.push_back(std::move(request));
    if (requests_.size() > 1) return true;
  }
  wake_();
  return true;
}

std::vector<ClientRequest> RequestQueue::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(requests_, {});
}

void RequestQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

}  // namespace tessera
