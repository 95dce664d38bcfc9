// Conversion of statuses: gRPC's and ours have the same codes.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

namespace tessera {

// Longer messages are truncated: a status travels in the headers of a reply, which are small.
inline constexpr std::size_t kStatusMessageBytesMax = 2000;

grpc::Status to_grpc(const absl::Status& status);
absl::Status from_grpc(const grpc::Status& status);

}  // namespace tessera
