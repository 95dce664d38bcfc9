// A module as it was read, with its structure checked.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "lpss/wasm/binary.h"
#include "lpss/wasm/interface.h"

namespace tessera::wasm {

enum class Type : std::uint8_t { kAny = 0, kF64 = 0x7c, kF32 = 0x7d, kI64 = 0x7e, kI32 = 0x7f };

struct FunctionType {
  std::vector<Type> parameters;
  std::optional<Type> result;
  friend bool operator==(const FunctionType&, const FunctionType&) = default;
};

struct ImportedFunction {
  Import import = Import::kSenses;
  std::uint32_t type = 0;
};

struct Global {
  Type type = Type::kI32;
  bool is_mutable = false;
  std::uint64_t bits = 0;  // that it begins with
};

struct Elements {
  std::uint32_t offset = 0;
  std::vector<std::uint32_t> functions;
};

struct Data {
  std::uint32_t offset = 0;
  std::span<const std::uint8_t> bytes;
};

// Functions, as everything, have places from 0 on: imported ones first. Views are into the file.
struct Module {
  std::vector<FunctionType> types;
  std::vector<ImportedFunction> imports;
  std::vector<std::uint32_t> functions;  // their types; those that are not imported
  std::optional<std::uint32_t> table;    // its size
  std::optional<std::uint32_t> pages;    // of memory, at first
  std::optional<std::uint32_t> pages_max;
  std::vector<Global> globals;
  std::optional<std::uint32_t> ask;
  std::optional<std::uint32_t> run;
  std::vector<Elements> elements;
  std::vector<Reader> bodies;  // of functions
  std::vector<Data> data;
  std::string_view description;  // the custom section "tessera"

  std::uint32_t function_count() const {
    return static_cast<std::uint32_t>(imports.size() + functions.size());
  }
  std::uint32_t type_of(std::uint32_t function) const {
    return function < imports.size() ? imports[function].type : functions[function - imports.size()];
  }
};

// Throws Refusal. Bodies are not looked at.
Module read_module(std::span<const std::uint8_t> file);

Type read_type(Reader& reader);
// Of a letter in opcodes.h or interface.h.
Type type_of_letter(char letter);

}  // namespace tessera::wasm
