// Messages in the text form of protobuf, as plugins have them: "linear: {x: 3}".
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tessera::gazebo {

// Its fields in their order, by their whole names: {"linear.x", "3"}. Texts are without quotes.
using MessageFields = std::vector<std::pair<std::string, std::string>>;

// INVALID_ARGUMENT, with the place.
absl::StatusOr<MessageFields> read_message_text(absl::string_view text);

// The first field of this name as a number, where "true" is 1 and "false" 0; nothing where it is none, or not
// there.
std::optional<double> number_in(const MessageFields& fields, absl::string_view name);

// "true", "false" or a number.
std::optional<double> number_of_text(absl::string_view text);

}  // namespace tessera::gazebo
