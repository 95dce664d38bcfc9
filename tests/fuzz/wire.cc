// Packed structs of the tick: what can be read is written as the same bytes again.
#include "proto/wire.h"

#include "lpss/base/invariant.h"
#include "tests/fuzz/input.h"

namespace tessera {
namespace {

template <typename T>
void same_again(std::string_view bytes, const absl::StatusOr<T>& read) {
  if (!read.ok()) return;
  if constexpr (requires { pack(std::span(*read)); }) {
    invariant(pack(std::span(std::as_const(*read))) == bytes, "what is read is written as it was");
  } else {
    invariant(pack(*read) == bytes, "what is read is written as it was");
  }
}

void read(std::uint8_t kind, std::string_view bytes) {
  switch (kind) {
    case 'b':
      return same_again(bytes, unpack_records(bytes));
    case 'j':
      return same_again(bytes, unpack_joints(bytes));
    case 'c':
      return same_again(bytes, unpack_commands(bytes));
    case 'r':
      return same_again(bytes, unpack_round(bytes));
    case 'w':
      return same_again(bytes, unpack_shared(bytes));
    case 's':
      return same_again(bytes, unpack_sectors(bytes));
    default:
      return;
  }
}

}  // namespace
}  // namespace tessera

// The first byte says what the others are.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) tessera::read(data[0], tessera::fuzz::text_of(data + 1, size - 1));
  return 0;
}
