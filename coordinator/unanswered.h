// The end of calls that are left to whoever leads next.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

namespace tessera {

// Whoever leads next may carry out a call, or may have its answer: for the client, it ends like one whose
// connection is lost. UNAVAILABLE.
absl::Status unanswered_error(absl::string_view message);
bool is_unanswered(const absl::Status& status);

}  // namespace tessera
