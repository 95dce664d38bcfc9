#include "lpss/base/utf8.h"

#include <cstddef>
#include <cstdint>

namespace tessera {
namespace {

// What a first byte says of its character: how many bytes follow, and the bounds of the next one.
struct Lead {
  std::size_t followers = 0;
  std::uint8_t least = 0x80;
  std::uint8_t most = 0xbf;
};

// False for a byte that begins no character. RFC 3629, section 4.
bool read_lead(std::uint8_t byte, Lead& lead) {
  if (byte < 0x80) {
    lead = {};
  } else if (byte >= 0xc2 && byte <= 0xdf) {
    lead = {1};
  } else if (byte >= 0xe0 && byte <= 0xef) {
    lead = {2, static_cast<std::uint8_t>(byte == 0xe0 ? 0xa0 : 0x80),
            static_cast<std::uint8_t>(byte == 0xed ? 0x9f : 0xbf)};
  } else if (byte >= 0xf0 && byte <= 0xf4) {
    lead = {3, static_cast<std::uint8_t>(byte == 0xf0 ? 0x90 : 0x80),
            static_cast<std::uint8_t>(byte == 0xf4 ? 0x8f : 0xbf)};
  } else {
    return false;
  }
  return true;
}

}  // namespace

bool is_utf8(absl::string_view text) {
  for (std::size_t n = 0; n < text.size(); ++n) {
    Lead lead;
    if (!read_lead(static_cast<std::uint8_t>(text[n]), lead)) return false;
    for (; lead.followers > 0; --lead.followers) {
      if (++n == text.size()) return false;
      const auto byte = static_cast<std::uint8_t>(text[n]);
      if (byte < lead.least || byte > lead.most) return false;
      lead.least = 0x80;
      lead.most = 0xbf;
    }
  }
  return true;
}

}  // namespace tessera
