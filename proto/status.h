// Conversion of statuses: gRPC's and ours have the same codes.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include <string>

namespace tessera {

// Longer messages are truncated: a status travels in the headers of a reply, which are small.
inline constexpr std::size_t kStatusMessageBytesMax = 2000;

// A coordinator that stands by, or ends, has done nothing with a call: another one leads, or will. Other
// calls that end with UNAVAILABLE may have taken effect.
absl::Status stands_by_error(const std::string& message);
bool stands_by(const grpc::Status& status);

grpc::Status to_grpc(const absl::Status& status);
absl::Status from_grpc(const grpc::Status& status);

}  // namespace tessera
