// Connections to one daemon, over which calls of many clients go.
#pragma once

#include <grpcpp/generic/generic_stub.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "keys/keys_folder.h"

namespace tessera {

// A channel as the gateway opens them: it tries again soon, and notices where the other host is gone.
std::shared_ptr<grpc::Channel> open_line(const std::string& address, const ClientKeys& keys);

// Safe to use from any thread.
class DaemonLines : public std::enable_shared_from_this<DaemonLines> {
 public:
  // `keys` are those with which calls are passed on.
  DaemonLines(std::string address, ClientKeys keys) : address_(std::move(address)), keys_(std::move(keys)) {}

  const std::string& address() const { return address_; }

  // A connection with room for one more call, which it has until the last copy is gone.
  std::shared_ptr<grpc::GenericStub> take();

 private:
  struct Line {
    explicit Line(const std::shared_ptr<grpc::Channel>& channel) : stub(channel) {}

    grpc::GenericStub stub;
    int calls = 0;  // guarded by mutex_
  };

  const std::string address_;
  const ClientKeys keys_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Line>> lines_;  // never fewer
};

}  // namespace tessera
