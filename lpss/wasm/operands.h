// The stack of operands while a body is checked, as in the appendix "Validation Algorithm" of the
// specification of WebAssembly.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lpss/wasm/module.h"

namespace tessera::wasm {

// A block, or the body itself.
struct Frame {
  std::uint8_t opcode = 0;  // of its beginning
  std::optional<Type> result;
  std::size_t height = 0;  // of operands, where it begins
  bool is_unreachable = false;
  // What a branch to it takes along.
  std::optional<Type> label() const;
};

// Throws Refusal at the place of the reader.
class Operands {
 public:
  explicit Operands(const Reader& reader) : reader_(reader) {}

  void push(Type type);
  void push(std::optional<Type> type) {
    if (type) push(*type);
  }
  // Its type; kAny in code that is never reached.
  Type pop();
  Type pop(Type expected);
  void pop(std::optional<Type> expected) {
    if (expected) pop(*expected);
  }

  void begin(std::uint8_t opcode, std::optional<Type> result);
  Frame end();
  // What follows is never reached.
  void stop();
  Frame& frame(std::uint32_t depth);
  std::size_t nesting() const { return frames_.size(); }
  std::uint32_t most() const { return most_; }

 private:
  const Reader& reader_;
  std::vector<Type> operands_;
  std::vector<Frame> frames_;
  std::uint32_t most_ = 0;
};

}  // namespace tessera::wasm
