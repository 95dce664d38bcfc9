#include "lpss/wasm/test_modules.h"

#include <wabt/binary-writer.h>
#include <wabt/error-formatter.h>
#include <wabt/ir.h>
#include <wabt/stream.h>
#include <wabt/wast-lexer.h>
#include <wabt/wast-parser.h>

#include <cstdio>
#include <cstdlib>

#include "lpss/wasm/binary.h"

namespace tessera::wasm {

std::string assembled(std::string_view text) {
  wabt::Errors errors;
  const auto lexer = wabt::WastLexer::CreateBufferLexer("test", text.data(), text.size(), &errors);
  std::unique_ptr<wabt::Module> module;
  wabt::Features features;
  features.EnableAll();
  wabt::WastParseOptions options(features);
  wabt::MemoryStream stream;
  if (wabt::Failed(wabt::ParseWatModule(lexer.get(), &module, &errors, &options)) ||
      wabt::Failed(wabt::WriteBinaryModule(&stream, module.get(),
                                           wabt::WriteBinaryOptions(features, true, false, false)))) {
    for (const wabt::Error& error : errors)
      std::fprintf(stderr, "%zu: %s\n", static_cast<std::size_t>(error.loc.line), error.message.c_str());
    std::exit(1);
  }
  const std::vector<std::uint8_t>& bytes = stream.output_buffer().data;
  return {bytes.begin(), bytes.end()};
}

std::string custom_section(std::string_view name, std::string_view contents) {
  Writer body;
  body.name(name);
  body.append(contents);
  Writer section;
  section.byte(0);
  section.u32(body.size());
  section.append(body.text());
  return section.text();
}

std::string test_module(std::string_view text, std::string_view description) {
  return assembled(text) + custom_section("tessera", description);
}

}  // namespace tessera::wasm
