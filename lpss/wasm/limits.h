// Named limits of WebAssembly modules.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::wasm {

inline constexpr std::size_t kModuleBytesMax = 1u << 20;
inline constexpr std::uint32_t kTypesMax = 1024;
inline constexpr std::uint32_t kFunctionsMax = 8192;
inline constexpr std::uint32_t kParametersMax = 64;  // of a function
inline constexpr std::uint32_t kLocalsMax = 1024;    // of a function, with its parameters
inline constexpr std::uint32_t kOperandsMax = 1024;  // at a time
inline constexpr std::uint32_t kNestingMax = 1024;   // blocks in blocks
inline constexpr std::uint32_t kLabelsMax = 4096;    // of a br_table
inline constexpr std::uint32_t kGlobalsMax = 1024;
inline constexpr std::uint32_t kTableMax = 4096;
inline constexpr std::uint32_t kSegmentsMax = 4096;  // of data, and of elements
inline constexpr std::uint32_t kPageBytes = 65536;
inline constexpr std::uint32_t kPagesMax = 32;

// In one call of ask() or run().
inline constexpr std::int32_t kInstructionsMax = 1'000'000;
inline constexpr std::int32_t kImportInstructions = 32;  // that a call of the host counts as
// Numbers on the stack: locals and operands of all functions that have been called and have not returned.
inline constexpr std::int32_t kStackMax = 16384;
inline constexpr std::int32_t kCallStack = 8;  // that a call takes beside

}  // namespace tessera::wasm
