// etcd by its gRPC API.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "coordinator/etcd.h"

namespace tessera {

// `urls` are members of one etcd cluster, "http://host:port" or "host:port"; calls go to one of them, and to
// the next after an error. There is no TLS. `wake` is called on a thread of its own after each call.
// INVALID_ARGUMENT for a malformed URL. Waits for nothing: where etcd is gone, calls fail.
absl::StatusOr<std::unique_ptr<Etcd>> connect_etcd(const std::vector<std::string>& urls,
                                                   std::function<void()> wake);

}  // namespace tessera
