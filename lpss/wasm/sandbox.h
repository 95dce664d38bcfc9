// Makes a WebAssembly module that somebody has written safe to run inside the tick.
//
// The module is checked in full: its structure, its types, and that it asks for nothing but the functions of
// its host (interface.h). It is then rewritten so that
//
// - it ends: instructions are charged where runs of them begin, and a budget that is spent ends it;
// - its calls take a bounded part of the stack;
// - it has no memory from call to call: its globals begin anew in each, and it notes which blocks of its
//   memory it writes, for the host to restore;
// - it computes the same bits on every machine: a NaN is made the canonical one where its bits can be seen.
//
// So any engine that is right gives the same results, and ends a module at the same instruction.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace tessera::wasm {

struct SandboxedModule {
  std::string binary;       // with the exports of interface.h
  std::string description;  // what it says of its program
  std::string memory;       // as it begins, in full
  std::uint32_t block_shift = 0;
  bool has_ask = false;
  bool removes_joints = false;  // it asks for the function that does
};

// INVALID_ARGUMENT, naming the section and the byte of the file.
absl::StatusOr<SandboxedModule> sandboxed(std::string_view file);

}  // namespace tessera::wasm
