// What calls of the service have in common.
#pragma once

#include <grpcpp/grpcpp.h>

#include <mutex>
#include <utility>

namespace tessera {

// Shared between a call and the reply to it, which may come after the call has ended. Whoever takes the call
// ends it.
template <typename Call>
class CallPlace {
 public:
  explicit CallPlace(Call* call) : call_(call) {}

  // Null once it has been taken. gRPC may call back from within Finish(), so that is not under the lock.
  Call* take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(call_, nullptr);
  }

 private:
  std::mutex mutex_;
  Call* call_;
};

inline grpc::Status client_is_gone() {
  return {grpc::StatusCode::CANCELLED, "the client has disconnected, or its deadline has passed"};
}

}  // namespace tessera
