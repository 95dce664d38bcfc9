#include "lpss/wasm/binary.h"

#include <absl/strings/str_cat.h>

namespace tessera::wasm {

std::uint32_t Reader::count(std::uint32_t most, std::string_view of_what) {
  const std::uint32_t items = u32();
  if (items > most)
    refuse(absl::StrCat(items, " ", absl::string_view(of_what.data(), of_what.size()), " must be at most ",
                        most));
  if (items > left()) refuse("it ends too early");
  return items;
}

std::uint64_t Reader::unsigned_number(int bits) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < bits; shift += 7) {
    const std::uint8_t next = byte();
    const std::uint64_t part = next & 0x7f;
    if (shift + 7 > bits && (part >> (bits - shift)) != 0) break;
    value |= part << shift;
    if ((next & 0x80) == 0) return value;
  }
  refuse(absl::StrCat("a number has more than ", bits, " bits"));
}

std::int64_t Reader::signed_number(int bits) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < bits; shift += 7) {
    const std::uint8_t next = byte();
    value |= static_cast<std::uint64_t>(next & 0x7f) << shift;
    if ((next & 0x80) != 0) continue;
    const int used = shift + 7;
    auto result = static_cast<std::int64_t>(value);
    if (used < 64) result = static_cast<std::int64_t>(value << (64 - used)) >> (64 - used);
    const bool fits = bits == 64 ? used <= 63 || next == 0 || next == 0x7f
                                 : result >> (bits - 1) == 0 || result >> (bits - 1) == -1;
    if (!fits) break;
    return result;
  }
  refuse(absl::StrCat("a number has more than ", bits, " bits"));
}

}  // namespace tessera::wasm
