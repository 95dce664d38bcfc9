// Instructions of WebAssembly: the first version, with extensions of signs, conversions that saturate, and
// copying and filling of memory.
#pragma once

#include <cstdint>
#include <string_view>

namespace tessera::wasm::op {

enum : std::uint8_t {
  kUnreachable = 0x00,
  kNop = 0x01,
  kBlock = 0x02,
  kLoop = 0x03,
  kIf = 0x04,
  kElse = 0x05,
  kEnd = 0x0b,
  kBr = 0x0c,
  kBrIf = 0x0d,
  kBrTable = 0x0e,
  kReturn = 0x0f,
  kCall = 0x10,
  kCallIndirect = 0x11,
  kDrop = 0x1a,
  kSelect = 0x1b,
  kTypedSelect = 0x1c,
  kLocalGet = 0x20,
  kLocalSet = 0x21,
  kLocalTee = 0x22,
  kGlobalGet = 0x23,
  kGlobalSet = 0x24,
  kFirstLoad = 0x28,
  kFirstStore = 0x36,
  kF32Store = 0x38,
  kF64Store = 0x39,
  kLastStore = 0x3e,
  kMemorySize = 0x3f,
  kMemoryGrow = 0x40,
  kI32Const = 0x41,
  kI64Const = 0x42,
  kF32Const = 0x43,
  kF64Const = 0x44,
  kFirstNumeric = 0x45,
  kI32LtS = 0x48,
  kI32GtU = 0x4b,
  kF32Eq = 0x5b,
  kF64Eq = 0x61,
  kI32Add = 0x6a,
  kI32Sub = 0x6b,
  kI32Or = 0x72,
  kI32Shl = 0x74,
  kI32ShrU = 0x76,
  kF32Copysign = 0x98,
  kF64Copysign = 0xa6,
  kI32ReinterpretF32 = 0xbc,
  kI64ReinterpretF64 = 0xbd,
  kLastNumeric = 0xc4,
  kMore = 0xfc,
};

// After kMore.
enum : std::uint8_t { kLastSaturating = 7, kMemoryCopy = 10, kMemoryFill = 11 };

inline constexpr std::uint8_t kNoResult = 0x40;  // the type of a block

// Instructions with operands on the stack alone: their operands and, after the colon, their result. Letters:
// i of i32, I of i64, f of f32, F of f64.
constexpr std::string_view signature(std::uint8_t numeric) {
  struct Range {
    std::uint8_t last;
    std::string_view signature;
  };
  constexpr Range kRanges[] = {
      {0x45, "i:i"}, {0x4f, "ii:i"}, {0x50, "I:i"}, {0x5a, "II:i"}, {0x60, "ff:i"}, {0x66, "FF:i"},
      {0x69, "i:i"}, {0x78, "ii:i"}, {0x7b, "I:I"}, {0x8a, "II:I"}, {0x91, "f:f"},  {0x98, "ff:f"},
      {0x9f, "F:F"}, {0xa6, "FF:F"}, {0xa7, "I:i"}, {0xa9, "f:i"},  {0xab, "F:i"},  {0xad, "i:I"},
      {0xaf, "f:I"}, {0xb1, "F:I"},  {0xb3, "i:f"}, {0xb5, "I:f"},  {0xb6, "F:f"},  {0xb8, "i:F"},
      {0xba, "I:F"}, {0xbb, "f:F"},  {0xbc, "f:i"}, {0xbd, "F:I"},  {0xbe, "i:f"},  {0xbf, "I:F"},
      {0xc1, "i:i"}, {0xc4, "I:I"},
  };
  for (const Range& range : kRanges) {
    if (numeric <= range.last) return range.signature;
  }
  return {};
}

// Conversions to integers that saturate, after kMore.
inline constexpr std::string_view kSaturating[] = {"f:i", "f:i", "F:i", "F:i", "f:I", "f:I", "F:I", "F:I"};

// Loads and stores: the type of the number, and the largest alignment, as a power of two.
struct Access {
  char type;
  std::uint8_t alignment;
};
inline constexpr Access kAccesses[] = {
    {'i', 2}, {'I', 3}, {'f', 2}, {'F', 3}, {'i', 0}, {'i', 0}, {'i', 1}, {'i', 1}, {'I', 0},
    {'I', 0}, {'I', 1}, {'I', 1}, {'I', 2}, {'I', 2},                                          // loads
    {'i', 2}, {'I', 3}, {'f', 2}, {'F', 3}, {'i', 0}, {'i', 1}, {'I', 0}, {'I', 1}, {'I', 2},  // stores
};

}  // namespace tessera::wasm::op
