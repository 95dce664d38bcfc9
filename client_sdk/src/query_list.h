// Results of queries, as they come.
#pragma once

#include <absl/status/status.h>

#include "tessera.pb.h"

namespace tessera {

// Whether the reply has a result for each query, of its kind and well formed, as Answers wants it. DATA_LOSS.
absl::Status check_results(const v1::Request& request, const v1::Reply& reply);

}  // namespace tessera
