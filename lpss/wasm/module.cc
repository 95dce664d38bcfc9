#include "lpss/wasm/module.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <string>

#include "lpss/wasm/limits.h"
#include "lpss/wasm/opcodes.h"

namespace tessera::wasm {
namespace {

constexpr std::uint32_t kMagic = 0x6d736100;
constexpr std::uint32_t kVersion = 1;
constexpr std::string_view kHostModule = "tessera";

enum Section : std::uint8_t {
  kCustom,
  kTypes,
  kImportSection,
  kFunctions,
  kTables,
  kMemories,
  kGlobals,
  kExportSection,
  kStart,
  kElements,
  kCode,
  kData,
  kDataCount,
};
constexpr std::array<absl::string_view, 13> kSectionNames = {
    "custom", "type",  "import",  "function", "table", "memory",    "global",
    "export", "start", "element", "code",     "data",  "data count"};

// In which order sections come: the data count is before the code.
int order_of(std::uint8_t section) {
  if (section == kDataCount) return 2 * kCode - 1;
  return 2 * section;
}

std::string quoted(std::string_view text) {
  return absl::StrCat("\"", absl::string_view(text.data(), std::min<std::size_t>(text.size(), 64)), "\"");
}

FunctionType type_of(const ImportSpec& spec) {
  FunctionType type;
  for (const char letter : spec.parameters) type.parameters.push_back(type_of_letter(letter));
  if (!spec.result.empty()) type.result = type_of_letter(spec.result.front());
  return type;
}

class ModuleReader {
 public:
  explicit ModuleReader(std::span<const std::uint8_t> file) : reader_(file, 0, file.size()) {}

  Module read() {
    if (reader_.left() < 8 || reader_.raw<std::uint32_t>() != kMagic) refuse("it is no WebAssembly module");
    if (reader_.raw<std::uint32_t>() != kVersion) refuse("its version of WebAssembly must be 1");
    while (!reader_.ended()) {
      const std::uint8_t id = reader_.byte();
      if (id >= kSectionNames.size()) refuse(absl::StrCat("section ", id, " is unknown"));
      Reader section = reader_.part(reader_.u32());
      if (id != kCustom && order_of(id) <= last_)
        refuse(absl::StrCat("the ", kSectionNames[id], " section comes too late, or twice"));
      if (id != kCustom) last_ = order_of(id);
      try {
        read_section(id, section);
        if (id != kCustom && !section.ended()) section.refuse("it is longer than what is in it");
      } catch (Refusal& refusal) {
        refusal.what = absl::StrCat(kSectionNames[id], " section: ", refusal.what);
        throw;
      }
    }
    finish();
    return std::move(module_);
  }

 private:
  [[noreturn]] void refuse(std::string what) const { reader_.refuse(std::move(what)); }

  void read_section(std::uint8_t id, Reader& reader) {
    switch (id) {
      case kCustom:
        return read_custom(reader);
      case kTypes:
        return read_each(reader, kTypesMax, "types", [&] { read_function_type(reader); });
      case kImportSection:
        return read_each(reader, kFunctionsMax, "imports", [&] { read_import(reader); });
      case kFunctions:
        return read_each(reader, kFunctionsMax, "functions",
                         [&] { module_.functions.push_back(type_index(reader)); });
      case kTables:
        return read_each(reader, 1, "tables", [&] { read_table(reader); });
      case kMemories:
        return read_each(reader, 1, "memories", [&] { read_memory(reader); });
      case kGlobals:
        return read_each(reader, kGlobalsMax, "globals", [&] { read_global(reader); });
      case kExportSection:
        return read_each(reader, kFunctionsMax, "exports", [&] { read_export(reader); });
      case kStart:
        reader.refuse("a module must not have a start function");
      case kElements:
        return read_each(reader, kSegmentsMax, "segments", [&] { read_elements(reader); });
      case kCode:
        return read_each(reader, kFunctionsMax, "bodies",
                         [&] { module_.bodies.push_back(reader.part(reader.u32())); });
      case kData:
        return read_each(reader, kSegmentsMax, "segments", [&] { read_data(reader); });
      default:
        reader.u32();  // the number of segments of data
    }
  }

  template <typename Read>
  void read_each(Reader& reader, std::uint32_t most, std::string_view of_what, const Read& read) {
    for (std::uint32_t left = reader.count(most, of_what); left > 0; --left) read();
  }

  void read_custom(Reader& reader) {
    if (reader.name() != kHostModule) return;
    if (!module_.description.empty()) reader.refuse("there must be one that describes the program");
    const auto text = reader.bytes(reader.left());
    module_.description = {reinterpret_cast<const char*>(text.data()), text.size()};
  }

  void read_function_type(Reader& reader) {
    if (reader.byte() != 0x60) reader.refuse("a type must be that of a function");
    FunctionType type;
    read_each(reader, kParametersMax, "parameters", [&] { type.parameters.push_back(read_type(reader)); });
    read_each(reader, 1, "results of a function", [&] { type.result = read_type(reader); });
    module_.types.push_back(std::move(type));
  }

  std::uint32_t type_index(Reader& reader) {
    const std::uint32_t type = reader.u32();
    if (type >= module_.types.size()) reader.refuse(absl::StrCat("there is no type ", type));
    return type;
  }

  void read_import(Reader& reader) {
    const std::string_view from = reader.name();
    const std::string_view name = reader.name();
    const std::string title = absl::StrCat("import ", quoted(name), " of ", quoted(from));
    if (from != kHostModule) reader.refuse(absl::StrCat(title, " must be of \"tessera\""));
    if (reader.byte() != 0) reader.refuse(absl::StrCat(title, " must be a function"));
    const auto spec = std::ranges::find(kImports, name, &ImportSpec::name);
    if (spec == std::end(kImports)) reader.refuse(absl::StrCat(title, " is unknown"));
    const std::uint32_t type = type_index(reader);
    if (module_.types[type] != type_of(*spec)) reader.refuse(absl::StrCat(title, " is of another type"));
    module_.imports.push_back({static_cast<Import>(spec - kImports), type});
  }

  // Least and most.
  std::pair<std::uint32_t, std::optional<std::uint32_t>> limits(Reader& reader) {
    const std::uint8_t flags = reader.byte();
    if (flags > 1) reader.refuse("what threads share, and addresses of 64 bits, are not allowed");
    const std::uint32_t least = reader.u32();
    if (flags == 0) return {least, std::nullopt};
    return {least, reader.u32()};
  }

  void read_table(Reader& reader) {
    if (reader.byte() != 0x70) reader.refuse("a table must be of functions");
    module_.table = limits(reader).first;
    if (*module_.table > kTableMax)
      reader.refuse(absl::StrCat(*module_.table, " functions of the table must be at most ", kTableMax));
  }

  void read_memory(Reader& reader) {
    const auto [pages, most] = limits(reader);
    if (pages > kPagesMax) reader.refuse(absl::StrCat(pages, " pages of memory must be at most ", kPagesMax));
    if (pages == 0) reader.refuse("a memory must have at least one page");
    if (most && *most < pages) reader.refuse("the memory is larger than its largest size");
    module_.pages = pages;
    module_.pages_max = most;
  }

  // A constant of this type.
  std::uint64_t constant(Reader& reader, Type type) {
    static constexpr auto kConstants =
        std::to_array<std::pair<Type, std::uint8_t>>({{Type::kI32, op::kI32Const},
                                                      {Type::kI64, op::kI64Const},
                                                      {Type::kF32, op::kF32Const},
                                                      {Type::kF64, op::kF64Const}});
    if (reader.byte() != std::ranges::find(kConstants, type, &std::pair<Type, std::uint8_t>::first)->second)
      reader.refuse("it must begin with a constant of its type");
    std::uint64_t bits = 0;
    if (type == Type::kI32) bits = static_cast<std::uint32_t>(reader.s32());
    if (type == Type::kI64) bits = static_cast<std::uint64_t>(reader.s64());
    if (type == Type::kF32) bits = reader.raw<std::uint32_t>();
    if (type == Type::kF64) bits = reader.raw<std::uint64_t>();
    if (reader.byte() != op::kEnd) reader.refuse("it must begin with a constant of its type");
    return bits;
  }

  void read_global(Reader& reader) {
    Global global;
    global.type = read_type(reader);
    const std::uint8_t is_mutable = reader.byte();
    if (is_mutable > 1) reader.refuse("a global must be mutable or not");
    global.is_mutable = is_mutable == 1;
    global.bits = constant(reader, global.type);
    module_.globals.push_back(global);
  }

  void read_export(Reader& reader) {
    const std::string_view name = reader.name();
    const bool is_function = reader.byte() == 0;
    const std::uint32_t place = reader.u32();
    if (!is_function || (name != "ask" && name != "run")) return;
    if (place >= module_.function_count()) reader.refuse(absl::StrCat("there is no function ", place));
    if (module_.types[module_.type_of(place)] != FunctionType{})
      reader.refuse(absl::StrCat(quoted(name), " must have no parameters and no result"));
    (name == "ask" ? module_.ask : module_.run) = place;
  }

  void read_elements(Reader& reader) {
    if (reader.u32() != 0) reader.refuse("elements must be functions of the table, given at the start");
    Elements elements;
    elements.offset = static_cast<std::uint32_t>(constant(reader, Type::kI32));
    read_each(reader, kTableMax, "elements", [&] {
      elements.functions.push_back(reader.u32());
      if (elements.functions.back() >= module_.function_count())
        reader.refuse(absl::StrCat("there is no function ", elements.functions.back()));
    });
    if (std::uint64_t{elements.offset} + elements.functions.size() > module_.table.value_or(0))
      reader.refuse("elements are outside the table");
    module_.elements.push_back(std::move(elements));
  }

  void read_data(Reader& reader) {
    if (reader.u32() != 0) reader.refuse("data must be in the memory from the start");
    Data data;
    data.offset = static_cast<std::uint32_t>(constant(reader, Type::kI32));
    data.bytes = reader.bytes(reader.u32());
    if (std::uint64_t{data.offset} + data.bytes.size() >
        std::uint64_t{module_.pages.value_or(0)} * kPageBytes)
      reader.refuse("data are outside the memory");
    module_.data.push_back(data);
  }

  void finish() const {
    if (module_.bodies.size() != module_.functions.size())
      refuse(absl::StrCat(module_.functions.size(), " functions have ", module_.bodies.size(), " bodies"));
    if (!module_.pages) refuse("a module must have a memory");
    if (!module_.run) refuse("a module must export the function \"run\"");
    if (module_.description.empty())
      refuse("a module must have the custom section \"tessera\", which describes its program");
  }

  Reader reader_;
  Module module_;
  int last_ = 0;
};

}  // namespace

Type type_of_letter(char letter) {
  switch (letter) {
    case 'i':
      return Type::kI32;
    case 'I':
      return Type::kI64;
    case 'f':
      return Type::kF32;
    default:
      return Type::kF64;
  }
}

Type read_type(Reader& reader) {
  const std::uint8_t byte = reader.byte();
  if (byte < 0x7c || byte > 0x7f) reader.refuse("a type must be i32, i64, f32 or f64");
  return static_cast<Type>(byte);
}

Module read_module(std::span<const std::uint8_t> file) {
  if (file.size() > kModuleBytesMax)
    throw Refusal{kModuleBytesMax,
                  absl::StrCat("its ", file.size(), " bytes must be at most ", kModuleBytesMax)};
  return ModuleReader(file).read();
}

}  // namespace tessera::wasm
