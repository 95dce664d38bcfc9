#include "coordinator/unanswered.h"

#include <absl/strings/cord.h>

namespace tessera {
namespace {

constexpr const char* kPayload = "tessera/unanswered";

}  // namespace

absl::Status unanswered_error(absl::string_view message) {
  absl::Status status = absl::UnavailableError(message);
  status.SetPayload(kPayload, absl::Cord());
  return status;
}

bool is_unanswered(const absl::Status& status) { return status.GetPayload(kPayload).has_value(); }

}  // namespace tessera
