#include "daemon/whole_request.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_split.h>

#include <cstdint>
#include <utility>

namespace tessera {

RequestPart part_of_request(absl::string_view bytes) {
  constexpr absl::string_view kEnd = "\r\n\r\n";
  const std::size_t end = bytes.find(kEnd);
  if (end == absl::string_view::npos) {
    return bytes.size() < kRequestHeadBytesMax ? RequestPart::kSome : RequestPart::kUnfit;
  }
  if (end > kRequestHeadBytesMax) return RequestPart::kUnfit;
  std::uint64_t body = 0;
  for (const absl::string_view line : absl::StrSplit(bytes.substr(0, end), "\r\n")) {
    const std::pair<absl::string_view, absl::string_view> header =
        absl::StrSplit(line, absl::MaxSplits(':', 1));
    const absl::string_view name = absl::StripAsciiWhitespace(header.first);
    if (absl::EqualsIgnoreCase(name, "transfer-encoding")) return RequestPart::kUnfit;
    if (!absl::EqualsIgnoreCase(name, "content-length")) continue;
    if (!absl::SimpleAtoi(absl::StripAsciiWhitespace(header.second), &body) || body > kRequestBodyBytesMax) {
      return RequestPart::kUnfit;
    }
  }
  return bytes.size() >= end + kEnd.size() + body ? RequestPart::kWhole : RequestPart::kSome;
}

}  // namespace tessera
