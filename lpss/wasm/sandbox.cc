#include "lpss/wasm/sandbox.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <span>

#include "lpss/wasm/function.h"
#include "lpss/wasm/interface.h"
#include "lpss/wasm/limits.h"
#include "lpss/wasm/module.h"
#include "lpss/wasm/opcodes.h"

namespace tessera::wasm {
namespace {

constexpr std::uint32_t kBlocks = 32;  // bits of Sandbox::dirty
constexpr std::uint8_t kFunctionExport = 0;
constexpr std::uint8_t kMemoryKind = 2;

template <typename Write>
void write_section(Writer& out, std::uint8_t id, const Write& write) {
  Writer section;
  write(section);
  out.byte(id);
  out.u32(section.size());
  out.append(section.text());
}

void write_types(Writer& out, std::span<const Type> types) {
  out.u32(types.size());
  for (const Type type : types) out.byte(static_cast<std::uint8_t>(type));
}

void write_type(Writer& out, const FunctionType& type) {
  out.byte(0x60);
  write_types(out, type.parameters);
  write_types(out, type.result ? std::span(&*type.result, 1) : std::span<const Type>());
}

void write_constant(Writer& out, Type type, std::uint64_t bits) {
  switch (type) {
    case Type::kI32:
      out.byte(op::kI32Const);
      out.s64(static_cast<std::int32_t>(bits));
      break;
    case Type::kI64:
      out.byte(op::kI64Const);
      out.s64(static_cast<std::int64_t>(bits));
      break;
    case Type::kF32:
      out.byte(op::kF32Const);
      out.raw(static_cast<std::uint32_t>(bits));
      break;
    default:
      out.byte(op::kF64Const);
      out.raw(bits);
  }
}

class ModuleWriter {
 public:
  // `may_grow`: the memory has its largest size from the start.
  ModuleWriter(const Module& module, bool may_grow) : module_(module) {
    const auto globals = static_cast<std::uint32_t>(module.globals.size());
    const std::uint32_t most = std::min(module.pages_max.value_or(kPagesMax), kPagesMax);
    sandbox_.budget = globals;
    sandbox_.depth = globals + 1;
    sandbox_.dirty = globals + 2;
    sandbox_.pages = globals + 3;
    sandbox_.pages_max = may_grow ? most : *module.pages;
    const std::uint32_t bytes = std::bit_ceil(std::max(sandbox_.pages_max, 1u) * kPageBytes);
    sandbox_.block_shift = static_cast<std::uint32_t>(std::countr_zero(bytes / kBlocks));
  }

  // Nothing: the memory may grow after all.
  std::optional<SandboxedModule> write(bool may_grow) {
    Writer code;
    if (write_bodies(code) && !may_grow) return std::nullopt;
    Writer out;
    out.append(std::string_view("\0asm\1\0\0\0", 8));
    write_section(out, 1, [this](Writer& to) { write_all_types(to); });
    write_section(out, 2, [this](Writer& to) { write_imports(to); });
    write_section(out, 3, [this](Writer& to) { write_functions(to); });
    if (module_.table) write_section(out, 4, [this](Writer& to) { write_table(to); });
    write_section(out, 5, [this](Writer& to) { write_memory(to); });
    write_section(out, 6, [this](Writer& to) { write_globals(to); });
    write_section(out, 7, [this](Writer& to) { write_exports(to); });
    if (!module_.elements.empty()) write_section(out, 9, [this](Writer& to) { write_elements(to); });
    write_section(out, 10, [&](Writer& to) { to.append(code.text()); });
    if (!module_.data.empty()) write_section(out, 11, [this](Writer& to) { write_data(to); });
    SandboxedModule result;
    result.binary = std::move(out.text());
    result.description = std::string(module_.description);
    result.memory.resize(std::size_t{sandbox_.pages_max} * kPageBytes);
    for (const Data& data : module_.data) std::ranges::copy(data.bytes, result.memory.begin() + data.offset);
    result.block_shift = sandbox_.block_shift;
    result.has_ask = module_.ask.has_value();
    result.removes_joints = std::ranges::any_of(
        module_.imports, [](const auto& import) { return import.import == Import::kRemoveJoint; });
    return result;
  }

 private:
  // Those of kExports that it has.
  std::vector<Export> exports() const {
    std::vector<Export> all;
    if (module_.ask) all.push_back(Export::kAsk);
    for (const Export one : {Export::kRun, Export::kLeft, Export::kDepth}) all.push_back(one);
    return all;
  }

  void write_all_types(Writer& out) const {
    out.u32(module_.types.size() + 1);
    for (const FunctionType& type : module_.types) write_type(out, type);
    write_type(out, {{}, Type::kI32});
  }

  void write_imports(Writer& out) const {
    out.u32(module_.imports.size());
    for (const ImportedFunction& import : module_.imports) {
      out.name("tessera");
      out.name(kImports[static_cast<std::size_t>(import.import)].name);
      out.byte(kFunctionExport);
      out.u32(import.type);
    }
  }

  void write_functions(Writer& out) const {
    out.u32(module_.functions.size() + exports().size());
    for (const std::uint32_t type : module_.functions) out.u32(type);
    for (std::size_t n = 0; n < exports().size(); ++n) out.u32(module_.types.size());
  }

  void write_table(Writer& out) const {
    out.u32(1);
    out.byte(0x70);
    out.byte(1);
    out.u32(*module_.table);
    out.u32(*module_.table);
  }

  void write_memory(Writer& out) const {
    out.u32(1);
    out.byte(1);
    out.u32(sandbox_.pages_max);
    out.u32(sandbox_.pages_max);
  }

  void write_globals(Writer& out) const {
    out.u32(module_.globals.size() + 4);
    const auto write = [&out](const Global& global) {
      out.byte(static_cast<std::uint8_t>(global.type));
      out.byte(global.is_mutable ? 1 : 0);
      write_constant(out, global.type, global.bits);
      out.byte(op::kEnd);
    };
    for (const Global& global : module_.globals) write(global);
    for (int n = 0; n < 4; ++n) write({Type::kI32, true, 0});
  }

  void write_exports(Writer& out) const {
    out.u32(exports().size() + 1);
    out.name(kMemoryExport);
    out.byte(kMemoryKind);
    out.u32(0);
    std::uint32_t function = module_.function_count();
    for (const Export one : exports()) {
      out.name(kExports[static_cast<std::size_t>(one)]);
      out.byte(kFunctionExport);
      out.u32(function++);
    }
  }

  void write_elements(Writer& out) const {
    out.u32(module_.elements.size());
    for (const Elements& elements : module_.elements) {
      out.u32(0);
      write_constant(out, Type::kI32, elements.offset);
      out.byte(op::kEnd);
      out.u32(elements.functions.size());
      for (const std::uint32_t function : elements.functions) out.u32(function);
    }
  }

  void write_data(Writer& out) const {
    out.u32(module_.data.size());
    for (const Data& data : module_.data) {
      out.u32(0);
      write_constant(out, Type::kI32, data.offset);
      out.byte(op::kEnd);
      out.u32(data.bytes.size());
      out.append(data.bytes);
    }
  }

  // Whether the memory may grow.
  bool write_bodies(Writer& out) const {
    bool grows = false;
    out.u32(module_.bodies.size() + exports().size());
    for (std::uint32_t n = 0; n < module_.bodies.size(); ++n) {
      try {
        grows |= rewrite_function(module_, n, sandbox_, out);
      } catch (Refusal& refusal) {
        refusal.what =
            absl::StrCat("code section: function ", n + module_.imports.size(), ": ", refusal.what);
        throw;
      }
    }
    for (const Export one : exports()) write_export_body(out, one);
    return grows;
  }

  void write_export_body(Writer& out, Export which) const {
    Writer body;
    body.u32(0);
    const auto set = [&body](std::uint32_t global, Type type, std::uint64_t bits) {
      write_constant(body, type, bits);
      body.byte(op::kGlobalSet);
      body.u32(global);
    };
    std::uint32_t result = which == Export::kDepth ? sandbox_.depth : sandbox_.budget;
    if (which == Export::kAsk || which == Export::kRun) {
      result = sandbox_.dirty;
      set(sandbox_.budget, Type::kI32, kInstructionsMax);
      set(sandbox_.depth, Type::kI32, kStackMax);
      set(sandbox_.dirty, Type::kI32, 0);
      set(sandbox_.pages, Type::kI32, *module_.pages);
      for (std::uint32_t n = 0; n < module_.globals.size(); ++n) {
        const Global& global = module_.globals[n];
        if (global.is_mutable) set(n, global.type, global.bits);
      }
      body.byte(op::kCall);
      body.u32(which == Export::kAsk ? *module_.ask : *module_.run);
    }
    body.byte(op::kGlobalGet);
    body.u32(result);
    body.byte(op::kEnd);
    out.u32(body.size());
    out.append(body.text());
  }

  const Module& module_;
  Sandbox sandbox_;
};

}  // namespace

absl::StatusOr<SandboxedModule> sandboxed(std::string_view file) {
  try {
    const Module module = read_module({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()});
    std::optional<SandboxedModule> result = ModuleWriter(module, false).write(false);
    if (!result) result = ModuleWriter(module, true).write(true);
    return *std::move(result);
  } catch (const Refusal& refusal) {
    return absl::InvalidArgumentError(absl::StrCat("byte ", refusal.offset, ": ", refusal.what));
  }
}

}  // namespace tessera::wasm
