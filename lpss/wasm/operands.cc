#include "lpss/wasm/operands.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "lpss/wasm/limits.h"
#include "lpss/wasm/opcodes.h"

namespace tessera::wasm {
namespace {

const char* name_of(Type type) {
  switch (type) {
    case Type::kI32:
      return "i32";
    case Type::kI64:
      return "i64";
    case Type::kF32:
      return "f32";
    case Type::kF64:
      return "f64";
    default:
      return "any";
  }
}

}  // namespace

std::optional<Type> Frame::label() const { return opcode == op::kLoop ? std::nullopt : result; }

void Operands::push(Type type) {
  operands_.push_back(type);
  most_ = std::max(most_, static_cast<std::uint32_t>(operands_.size()));
  if (most_ > kOperandsMax) reader_.refuse(absl::StrCat("operands must be at most ", kOperandsMax));
}

Type Operands::pop() {
  if (frames_.empty()) reader_.refuse("code follows the end of the function");
  if (operands_.size() == frames_.back().height) {
    if (frames_.back().is_unreachable) return Type::kAny;
    reader_.refuse("an operand is missing");
  }
  const Type type = operands_.back();
  operands_.pop_back();
  return type;
}

Type Operands::pop(Type expected) {
  const Type type = pop();
  if (type != expected && type != Type::kAny && expected != Type::kAny)
    reader_.refuse(absl::StrCat("an operand is of ", name_of(type), " and must be of ", name_of(expected)));
  return type;
}

void Operands::begin(std::uint8_t opcode, std::optional<Type> result) {
  if (frames_.size() > kNestingMax)
    reader_.refuse(absl::StrCat("blocks in blocks must be at most ", kNestingMax));
  frames_.push_back({opcode, result, operands_.size(), false});
}

Frame Operands::end() {
  const Frame frame = this->frame(0);
  pop(frame.result);
  if (operands_.size() != frame.height) reader_.refuse("operands are left at the end of a block");
  frames_.pop_back();
  return frame;
}

void Operands::stop() {
  Frame& last = frame(0);
  operands_.resize(last.height);
  last.is_unreachable = true;
}

Frame& Operands::frame(std::uint32_t depth) {
  if (depth >= frames_.size()) reader_.refuse(absl::StrCat("there is no block ", depth));
  return frames_[frames_.size() - 1 - depth];
}

}  // namespace tessera::wasm
