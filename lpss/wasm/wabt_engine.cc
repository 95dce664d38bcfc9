#include <wabt/binary-reader.h>
#include <wabt/interp/binary-reader-interp.h>
#include <wabt/interp/interp.h>

#include <algorithm>
#include <utility>

#include "lpss/wasm/test_modules.h"

namespace tessera::wasm {
namespace {

namespace interp = wabt::interp;

class WabtInstance final : public Instance {
 public:
  bool start(const std::string& binary, std::string& error) {
    wabt::Errors errors;
    interp::ModuleDesc description;
    wabt::Features features;
    const wabt::ReadBinaryOptions options(features, nullptr, false, true, true);
    if (wabt::Failed(
            interp::ReadBinaryInterp("test", binary.data(), binary.size(), options, &errors, &description))) {
      error = errors.empty() ? "it is not valid" : errors.front().message;
      return false;
    }
    const auto module = interp::Module::New(store_, description);
    interp::RefVec imports;
    for (const interp::ImportDesc& import : description.imports) {
      const auto* const spec =
          std::find_if(std::begin(kImports), std::end(kImports),
                       [&](const ImportSpec& one) { return one.name == import.type.name; });
      const auto& type = *wabt::cast<interp::FuncType>(import.type.type.get());
      imports.push_back(
          interp::HostFunc::New(store_, type, callback(static_cast<Import>(spec - kImports))).ref());
    }
    interp::Trap::Ptr trap;
    instance_ = interp::Instance::Instantiate(store_, module.ref(), imports, &trap);
    if (!instance_) {
      error = trap->message();
      return false;
    }
    for (std::size_t n = 0; n < description.exports.size(); ++n) {
      exports_.emplace_back(description.exports[n].type.name, instance_->exports()[n]);
    }
    return true;
  }

  std::uint8_t* memory() override {
    return store_.UnsafeGet<interp::Memory>(exported(kMemoryExport))->UnsafeData();
  }

  bool call(Export function, Host& host, std::int32_t& result, std::string& trap) override {
    host_ = &host;
    const auto called =
        store_.UnsafeGet<interp::Func>(exported(kExports[static_cast<std::size_t>(function)]));
    interp::Values results;
    interp::Trap::Ptr trapped;
    if (wabt::Failed(called->Call(store_, {}, results, &trapped))) {
      trap = trapped->message();
      return false;
    }
    result = static_cast<std::int32_t>(results.at(0).Get<interp::u32>());
    return true;
  }

 private:
  interp::Ref exported(std::string_view name) const {
    return std::find_if(exports_.begin(), exports_.end(), [&](const auto& one) { return one.first == name; })
        ->second;
  }

  interp::HostFunc::Callback callback(Import import) {
    return [this, import](interp::Thread&, const interp::Values& given, interp::Values& results,
                          interp::Trap::Ptr* trap) {
      const ImportSpec& spec = kImports[static_cast<std::size_t>(import)];
      double arguments[kImportParametersMax] = {};
      for (std::size_t n = 0; n < given.size(); ++n) {
        arguments[n] = spec.parameters[n] == 'i' ? static_cast<std::int32_t>(given[n].Get<interp::u32>())
                                                 : given[n].Get<interp::f64>();
      }
      double result = 0;
      if (!host_->call(import, arguments, result)) {
        *trap = interp::Trap::New(store_, "");
        return wabt::Result::Error;
      }
      if (spec.result == "i")
        results[0] = interp::Value::Make(static_cast<interp::u32>(static_cast<std::int32_t>(result)));
      if (spec.result == "F") results[0] = interp::Value::Make(result);
      return wabt::Result::Ok;
    };
  }

  interp::Store store_;
  interp::Instance::Ptr instance_;
  std::vector<std::pair<std::string, interp::Ref>> exports_;
  Host* host_ = nullptr;
};

class WabtCode final : public Code {
 public:
  WabtCode(const char* bytes, std::size_t size) : binary(bytes, size) {}
  const std::string binary;
};

class WabtEngine final : public Engine {
 public:
  std::shared_ptr<const Code> compile(const char* binary, std::size_t bytes, std::string& error) override {
    auto code = std::make_shared<const WabtCode>(binary, bytes);
    return instantiate(*code, error) ? code : nullptr;
  }
  std::unique_ptr<Instance> instantiate(const Code& code, std::string& error) override {
    auto instance = std::make_unique<WabtInstance>();
    if (!instance->start(static_cast<const WabtCode&>(code).binary, error)) return nullptr;
    return instance;
  }
};

}  // namespace

std::unique_ptr<Engine> wabt_engine() { return std::make_unique<WabtEngine>(); }

}  // namespace tessera::wasm
