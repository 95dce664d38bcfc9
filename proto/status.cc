#include "proto/status.h"

#include <string>

namespace tessera {
namespace {

// The payload of the status, and the details of gRPC's.
constexpr const char* kStandsBy = "tessera/stands-by";

}  // namespace

absl::Status stands_by_error(const std::string& message) {
  absl::Status status = absl::UnavailableError(message);
  status.SetPayload(kStandsBy, absl::Cord());
  return status;
}

bool stands_by(const grpc::Status& status) { return status.error_details() == kStandsBy; }

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message(status.message().substr(0, kStatusMessageBytesMax));
  if (message.size() < status.message().size()) message += "...";
  return grpc::Status(static_cast<grpc::StatusCode>(status.code()), message,
                      status.GetPayload(kStandsBy) ? kStandsBy : "");
}

absl::Status from_grpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

}  // namespace tessera
