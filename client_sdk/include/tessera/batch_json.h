// Batches and their answers as JSON: the messages Request and Reply of proto/tessera.proto in protobuf's JSON
// form.
//
//   {"commands": [{"setVelocity": {"body": {"name": "cart"}, "linear": {"x": 1}}}],
//    "queries": [{"ray": {"origin": {"local": {"z": 10}}, "direction": {"z": -1}, "length": 20}}]}
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "tessera/batch.h"

namespace tessera {

// INVALID_ARGUMENT, with the field, for what is no such request.
absl::StatusOr<Batch> batch_from_json(std::string_view json);

std::string to_json(const Answers& answers);

}  // namespace tessera
