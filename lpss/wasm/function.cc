#include "lpss/wasm/function.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "lpss/wasm/limits.h"
#include "lpss/wasm/opcodes.h"
#include "lpss/wasm/operands.h"

namespace tessera::wasm {
namespace {

constexpr std::uint64_t kNaN64 = 0x7ff8000000000000;
constexpr std::uint32_t kNaN32 = 0x7fc00000;
// What copying and filling are charged for: an instruction for so many bytes, as a power of two.
constexpr std::int32_t kCopyShift = 3;

bool is_float(Type type) { return type == Type::kF32 || type == Type::kF64; }

// Instructions that are written after one another.
class Instructions {
 public:
  void op(std::uint8_t opcode) { writer_.byte(opcode); }
  void op(std::uint8_t opcode, std::uint32_t place) {
    writer_.byte(opcode);
    writer_.u32(place);
  }
  void constant(std::int32_t value) {
    writer_.byte(op::kI32Const);
    writer_.s64(value);
  }
  Writer& writer() { return writer_; }

 private:
  Writer writer_;
};

// Instructions come in runs that begin at their first and leave at their last. A run is written once it is
// complete: what it costs goes in front of it.
class FunctionRewriter {
 public:
  FunctionRewriter(const Module& module, std::uint32_t function, const Sandbox& sandbox)
      : module_(module),
        sandbox_(sandbox),
        type_(module.types[module.functions[function]]),
        reader_(module.bodies[function]),
        operands_(reader_) {}

  bool rewrite(Writer& out) {
    read_locals();
    operands_.begin(op::kBlock, type_.result);
    is_checked_ = true;
    while (operands_.nesting() > 0) read_instruction();
    if (!reader_.ended()) reader_.refuse("code follows the end of the function");
    patch_depth();
    Writer body;
    body.u32(groups_.size() + scratch_.size());
    for (const auto& [number, type] : groups_) write_locals(body, number, type);
    for (const Type type : scratch_) write_locals(body, 1, type);
    body.append(code_.text());
    out.u32(body.size());
    out.append(body.text());
    return grows_;
  }

 private:
  static void write_locals(Writer& out, std::uint32_t number, Type type) {
    out.u32(number);
    out.byte(static_cast<std::uint8_t>(type));
  }

  void read_locals() {
    locals_ = type_.parameters;
    for (std::uint32_t left = reader_.count(kLocalsMax, "groups of locals"); left > 0; --left) {
      const std::uint32_t number = reader_.u32();
      const Type type = read_type(reader_);
      if (number > kLocalsMax - std::min<std::size_t>(locals_.size(), kLocalsMax))
        reader_.refuse(absl::StrCat("locals must be at most ", kLocalsMax));
      locals_.insert(locals_.end(), number, type);
      groups_.emplace_back(number, type);
    }
  }

  // --- What is added ---

  // A local of its own, for what is added.
  std::uint32_t scratch(Type type, std::size_t nth = 0) {
    std::size_t place = 0;
    for (; place < scratch_.size(); ++place) {
      if (scratch_[place] == type && nth-- == 0) break;
    }
    if (place == scratch_.size()) scratch_.push_back(type);
    return static_cast<std::uint32_t>(locals_.size() + place);
  }

  // Ends a run.
  void flush() {
    Instructions charge;
    charge.op(op::kGlobalGet, sandbox_.budget);
    charge.constant(cost_);
    charge.op(op::kI32Sub);
    charge.op(op::kGlobalSet, sandbox_.budget);
    if (is_checked_) trap_if_negative(charge, sandbox_.budget);
    code_.append(charge.writer().text());
    for (const std::size_t place : run_depths_) depths_.push_back(code_.size() + place);
    code_.append(run_.writer().text());
    run_ = {};
    run_depths_.clear();
    cost_ = 0;
    is_checked_ = false;
  }

  static void trap_if_negative(Instructions& code, std::uint32_t global) {
    code.op(op::kGlobalGet, global);
    code.constant(0);
    code.op(op::kI32LtS);
    code.op(op::kIf);
    code.op(op::kNoResult);
    code.op(op::kUnreachable);
    code.op(op::kEnd);
  }

  // The last operand, with a NaN replaced by the one whose bits are the same on all machines.
  void make_canonical(Type type) {
    const std::uint32_t number = scratch(type);
    run_.op(op::kLocalTee, number);
    if (type == Type::kF32) {
      run_.op(op::kF32Const);
      run_.writer().raw(kNaN32);
    } else {
      run_.op(op::kF64Const);
      run_.writer().raw(kNaN64);
    }
    run_.op(op::kLocalGet, number);
    run_.op(op::kLocalGet, number);
    run_.op(type == Type::kF32 ? op::kF32Eq : op::kF64Eq);
    run_.op(op::kSelect);
  }

  // What a call takes of the stack is known at the end of the function: room for five bytes.
  void change_depth(std::uint8_t opcode) {
    run_.op(op::kGlobalGet, sandbox_.depth);
    run_.op(op::kI32Const);
    run_depths_.push_back(run_.writer().size());
    run_.writer().append(std::string_view("\0\0\0\0\0", 5));
    run_.op(opcode);
    run_.op(op::kGlobalSet, sandbox_.depth);
  }

  void patch_depth() {
    const std::uint32_t words = static_cast<std::uint32_t>(locals_.size() + scratch_.size()) +
                                operands_.most() + static_cast<std::uint32_t>(kCallStack);
    for (const std::size_t place : depths_) {
      for (std::size_t n = 0; n < 5; ++n) {
        const auto part = static_cast<char>((words >> (7 * n)) & 0x7f);
        code_.text()[place + n] = n < 4 ? static_cast<char>(part | 0x80) : part;
      }
    }
  }

  // --- What is there ---

  void copy() { run_.writer().append(reader_.since(begin_)); }

  void read_instruction() {
    begin_ = reader_.offset();
    const std::uint8_t opcode = reader_.byte();
    ++cost_;
    if (opcode >= op::kFirstNumeric && opcode <= op::kLastNumeric) return read_numeric(opcode);
    if (opcode >= op::kFirstLoad && opcode <= op::kLastStore) return read_access(opcode);
    switch (opcode) {
      case op::kMore:
        return read_more();
      case op::kMemorySize:
      case op::kMemoryGrow:
        return read_memory(opcode);
      case op::kI32Const:
      case op::kI64Const:
      case op::kF32Const:
      case op::kF64Const:
        return read_constant(opcode);
      case op::kLocalGet:
      case op::kLocalSet:
      case op::kLocalTee:
      case op::kGlobalGet:
      case op::kGlobalSet:
        return read_variable(opcode);
      case op::kDrop:
      case op::kSelect:
      case op::kTypedSelect:
        return read_choice(opcode);
      case op::kCall:
      case op::kCallIndirect:
        return read_call(opcode);
      default:
        return read_control(opcode);
    }
  }

  void read_control(std::uint8_t opcode) {
    switch (opcode) {
      case op::kNop:
        return copy();
      case op::kUnreachable:
        copy();
        operands_.stop();
        return flush();
      case op::kBlock:
      case op::kLoop:
      case op::kIf:
        return read_begin(opcode);
      case op::kElse:
      case op::kEnd:
        return read_end(opcode);
      case op::kBr:
      case op::kBrIf:
      case op::kBrTable:
      case op::kReturn:
        return read_branch(opcode);
      default:
        throw Refusal{begin_, absl::StrCat("instruction 0x", absl::Hex(opcode), " is not allowed")};
    }
  }

  void read_begin(std::uint8_t opcode) {
    std::optional<Type> result;
    const std::uint8_t type = reader_.byte();
    if (type >= 0x7c && type <= 0x7f) {
      result = static_cast<Type>(type);
    } else if (type != op::kNoResult) {
      reader_.refuse("a block must have no parameters, and at most one number as its result");
    }
    if (opcode == op::kIf) operands_.pop(Type::kI32);
    copy();
    operands_.begin(opcode, result);
    if (opcode == op::kBlock) return;
    flush();
    is_checked_ = opcode == op::kLoop;
  }

  void read_end(std::uint8_t opcode) {
    const Frame frame = operands_.end();
    if (opcode == op::kElse) {
      if (frame.opcode != op::kIf) reader_.refuse("an else must belong to an if");
      operands_.begin(op::kElse, frame.result);
    } else {
      if (frame.opcode == op::kIf && frame.result) reader_.refuse("an if with a result must have an else");
      if (operands_.nesting() > 0) operands_.push(frame.result);
    }
    copy();
    flush();
  }

  void read_branch(std::uint8_t opcode) {
    if (opcode == op::kBrTable) return read_branch_table();
    const bool may_stay = opcode == op::kBrIf;
    const auto nesting = static_cast<std::uint32_t>(operands_.nesting());
    const std::uint32_t depth = opcode == op::kReturn ? nesting - 1 : reader_.u32();
    if (may_stay) operands_.pop(Type::kI32);
    const std::optional<Type> label = operands_.frame(depth).label();
    operands_.pop(label);
    copy();
    flush();
    if (may_stay) return operands_.push(label);
    operands_.stop();
  }

  void read_branch_table() {
    std::vector<std::uint32_t> depths(reader_.count(kLabelsMax, "labels"));
    for (std::uint32_t& depth : depths) depth = reader_.u32();
    const std::optional<Type> label = operands_.frame(reader_.u32()).label();
    for (const std::uint32_t depth : depths) {
      if (operands_.frame(depth).label() != label) reader_.refuse("labels must be of one type");
    }
    operands_.pop(Type::kI32);
    operands_.pop(label);
    copy();
    flush();
    operands_.stop();
  }

  void read_call(std::uint8_t opcode) {
    std::uint32_t type = 0;
    bool is_import = false;
    const std::uint32_t place = reader_.u32();
    if (opcode == op::kCall) {
      if (place >= module_.function_count()) reader_.refuse(absl::StrCat("there is no function ", place));
      type = module_.type_of(place);
      is_import = place < module_.imports.size();
    } else {
      type = place;
      if (type >= module_.types.size()) reader_.refuse(absl::StrCat("there is no type ", type));
      if (reader_.u32() != 0 || !module_.table) reader_.refuse("there is no such table");
      operands_.pop(Type::kI32);
    }
    const FunctionType& called = module_.types[type];
    for (std::size_t n = called.parameters.size(); n-- > 0;) operands_.pop(called.parameters[n]);
    operands_.push(called.result);
    // A function of the host in the table costs this as well.
    if (is_import || opcode == op::kCallIndirect) cost_ += kImportInstructions;
    if (!is_import) {
      change_depth(op::kI32Sub);
      trap_if_negative(run_, sandbox_.depth);
    }
    copy();
    if (!is_import) change_depth(op::kI32Add);
  }

  void read_choice(std::uint8_t opcode) {
    if (opcode == op::kDrop) {
      operands_.pop();
      return copy();
    }
    Type type = Type::kAny;
    if (opcode == op::kTypedSelect) {
      if (reader_.u32() != 1) reader_.refuse("a select must be of one type");
      type = read_type(reader_);
    }
    operands_.pop(Type::kI32);
    const Type second = operands_.pop(type);
    const Type first = operands_.pop(second == Type::kAny ? type : second);
    operands_.push(type != Type::kAny ? type : first != Type::kAny ? first : second);
    copy();
  }

  void read_variable(std::uint8_t opcode) {
    const std::uint32_t place = reader_.u32();
    const bool is_local = opcode <= op::kLocalTee;
    const std::size_t number = is_local ? locals_.size() : module_.globals.size();
    if (place >= number) reader_.refuse(absl::StrCat("there is no ", is_local ? "local " : "global ", place));
    const Type type = is_local ? locals_[place] : module_.globals[place].type;
    if (opcode == op::kGlobalSet && !module_.globals[place].is_mutable)
      reader_.refuse(absl::StrCat("global ", place, " is constant"));
    const bool gets = opcode == op::kLocalGet || opcode == op::kGlobalGet;
    if (!gets) operands_.pop(type);
    if (gets || opcode == op::kLocalTee) operands_.push(type);
    copy();
  }

  void read_constant(std::uint8_t opcode) {
    if (opcode == op::kI32Const) {
      reader_.s32();
      operands_.push(Type::kI32);
    } else if (opcode == op::kI64Const) {
      reader_.s64();
      operands_.push(Type::kI64);
    } else if (opcode == op::kF32Const) {
      reader_.bytes(4);
      operands_.push(Type::kF32);
    } else {
      reader_.bytes(8);
      operands_.push(Type::kF64);
    }
    copy();
  }

  void apply(std::string_view signature) {
    const std::size_t colon = signature.find(':');
    for (std::size_t n = colon; n-- > 0;) operands_.pop(type_of_letter(signature[n]));
    operands_.push(type_of_letter(signature[colon + 1]));
  }

  // Where the bits of a number are looked at, a NaN must be the canonical one.
  void read_numeric(std::uint8_t opcode) {
    apply(op::signature(opcode));
    if (opcode == op::kI32ReinterpretF32 || opcode == op::kF32Copysign) make_canonical(Type::kF32);
    if (opcode == op::kI64ReinterpretF64 || opcode == op::kF64Copysign) make_canonical(Type::kF64);
    copy();
  }

  void read_access(std::uint8_t opcode) {
    const op::Access access = op::kAccesses[opcode - op::kFirstLoad];
    const Type type = type_of_letter(access.type);
    if (reader_.u32() > access.alignment) reader_.refuse("the alignment is larger than the number");
    const std::uint32_t offset = reader_.u32();
    if (opcode < op::kFirstStore) {
      operands_.pop(Type::kI32);
      operands_.push(type);
      return copy();
    }
    operands_.pop(type);
    operands_.pop(Type::kI32);
    if (is_float(type)) make_canonical(type);
    const std::uint32_t address = scratch(Type::kI32);
    const std::uint32_t value = scratch(type, type == Type::kI32 ? 1 : 0);
    run_.op(op::kLocalSet, value);
    run_.op(op::kLocalSet, address);
    run_.op(op::kGlobalGet, sandbox_.dirty);
    run_.constant(1);
    run_.op(op::kLocalGet, address);
    if (offset != 0) {
      run_.constant(static_cast<std::int32_t>(offset));
      run_.op(op::kI32Add);
    }
    run_.constant(static_cast<std::int32_t>(sandbox_.block_shift));
    run_.op(op::kI32ShrU);
    run_.op(op::kI32Shl);
    run_.op(op::kI32Or);
    run_.op(op::kGlobalSet, sandbox_.dirty);
    run_.op(op::kLocalGet, address);
    run_.op(op::kLocalGet, value);
    copy();
  }

  // The memory has its largest size from the start; a global has the size that the module sees.
  void read_memory(std::uint8_t opcode) {
    if (reader_.byte() != 0) reader_.refuse("there is no such memory");
    if (opcode == op::kMemorySize) {
      operands_.push(Type::kI32);
      return run_.op(op::kGlobalGet, sandbox_.pages);
    }
    grows_ = true;
    operands_.pop(Type::kI32);
    operands_.push(Type::kI32);
    const std::uint32_t more = scratch(Type::kI32);
    run_.op(op::kLocalTee, more);
    run_.constant(static_cast<std::int32_t>(sandbox_.pages_max));
    run_.op(op::kGlobalGet, sandbox_.pages);
    run_.op(op::kI32Sub);
    run_.op(op::kI32GtU);
    run_.op(op::kIf);
    run_.op(static_cast<std::uint8_t>(Type::kI32));
    run_.constant(-1);
    run_.op(op::kElse);
    run_.op(op::kGlobalGet, sandbox_.pages);
    run_.op(op::kGlobalGet, sandbox_.pages);
    run_.op(op::kLocalGet, more);
    run_.op(op::kI32Add);
    run_.op(op::kGlobalSet, sandbox_.pages);
    run_.op(op::kEnd);
  }

  void read_more() {
    const std::uint32_t opcode = reader_.u32();
    if (opcode <= op::kLastSaturating) {
      apply(op::kSaturating[opcode]);
      return copy();
    }
    if (opcode != op::kMemoryCopy && opcode != op::kMemoryFill)
      throw Refusal{begin_, absl::StrCat("instruction 0xfc ", opcode, " is not allowed")};
    for (int memories = opcode == op::kMemoryCopy ? 2 : 1; memories > 0; --memories) {
      if (reader_.byte() != 0) reader_.refuse("there is no such memory");
    }
    for (int operands = 3; operands > 0; --operands) operands_.pop(Type::kI32);
    // It is charged by the byte, and all of the memory counts as written.
    const std::uint32_t bytes = scratch(Type::kI32);
    run_.op(op::kLocalSet, bytes);
    run_.op(op::kGlobalGet, sandbox_.budget);
    run_.op(op::kLocalGet, bytes);
    run_.constant(kCopyShift);
    run_.op(op::kI32ShrU);
    run_.op(op::kI32Sub);
    run_.op(op::kGlobalSet, sandbox_.budget);
    trap_if_negative(run_, sandbox_.budget);
    run_.constant(-1);
    run_.op(op::kGlobalSet, sandbox_.dirty);
    run_.op(op::kLocalGet, bytes);
    copy();
  }

  const Module& module_;
  const Sandbox& sandbox_;
  const FunctionType& type_;
  Reader reader_;
  Operands operands_;
  std::vector<Type> locals_;  // parameters first
  std::vector<std::pair<std::uint32_t, Type>> groups_;
  std::vector<Type> scratch_;
  std::size_t begin_ = 0;  // of the instruction

  Writer code_;                      // runs that are complete
  std::vector<std::size_t> depths_;  // places in code_ for what a call takes of the stack
  Instructions run_;
  std::vector<std::size_t> run_depths_;  // likewise, in run_
  std::int32_t cost_ = 0;                // of the run, in instructions
  bool is_checked_ = false;              // the run ends a budget that is spent
  bool grows_ = false;
};

}  // namespace

bool rewrite_function(const Module& module, std::uint32_t function, const Sandbox& sandbox, Writer& out) {
  return FunctionRewriter(module, function, sandbox).rewrite(out);
}

}  // namespace tessera::wasm
