// Wakes a link that may not exist yet.
#pragma once

#include <mutex>

#include "transport/link.h"

namespace tessera {

// Any thread may wake; the link must be detached before it ends.
class Waker {
 public:
  void attach(Link* link) {
    const std::lock_guard lock(mutex_);
    link_ = link;
  }
  void detach() { attach(nullptr); }
  void wake() {
    const std::lock_guard lock(mutex_);
    if (link_ != nullptr) link_->wake();
  }

 private:
  std::mutex mutex_;
  Link* link_ = nullptr;
};

}  // namespace tessera
