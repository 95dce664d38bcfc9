// Checks the body of a function, and rewrites it so that it can do no harm.
#pragma once

#include <cstdint>

#include "lpss/wasm/module.h"

namespace tessera::wasm {

// What a sandboxed module has beside what was in it.
struct Sandbox {
  // Globals, all of i32.
  std::uint32_t budget = 0;  // instructions that are left
  std::uint32_t depth = 0;   // numbers on the stack that are left
  std::uint32_t dirty = 0;   // bits: which of 32 blocks of memory were written
  std::uint32_t pages = 0;   // of memory, as the module sees it
  std::uint32_t pages_max = 0;
  std::uint32_t block_shift = 0;  // a block of memory has 1 << block_shift bytes
};

// Writes the body, with its size in front, to `out`. Whether the memory may grow. Throws Refusal.
bool rewrite_function(const Module& module, std::uint32_t function, const Sandbox& sandbox, Writer& out);

}  // namespace tessera::wasm
