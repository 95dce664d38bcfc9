// How much of a request of HTTP has come.
#pragma once

#include <absl/strings/string_view.h>

#include <cstddef>

namespace tessera {

// Of a request that a door waits for.
inline constexpr std::size_t kRequestHeadBytesMax = 16 << 10;
inline constexpr std::size_t kRequestBodyBytesMax = 16 << 10;

enum class RequestPart {
  kSome,   // more is to come
  kWhole,  // with its body
  kUnfit,  // larger than the bounds above, or with a body whose length its head does not say
};

// Of `bytes`, all that a client has sent so far.
RequestPart part_of_request(absl::string_view bytes);

}  // namespace tessera
