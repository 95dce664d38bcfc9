// Runs sandboxed modules (sandbox.h). The engine is SpiderMonkey in a shared library of its own, which a
// process loads once it has a module: nothing else links it.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "lpss/wasm/interface.h"

namespace tessera::wasm {

// What a module calls.
class Host {
 public:
  virtual ~Host() = default;
  // Arguments are those of kImports; i32 and f64 are numbers alike. False: the module ends here.
  virtual bool call(Import import, const double* arguments, double& result) = 0;
};

// A module as the engine has compiled it, for all threads.
class Code {
 public:
  virtual ~Code() = default;
};

// A module with a memory of its own. It belongs to the thread that made it.
class Instance {
 public:
  virtual ~Instance() = default;
  // It stays where it is.
  virtual std::uint8_t* memory() = 0;
  // False: it was ended, by its host or by `trap`, such as "integer divide by zero".
  virtual bool call(Export function, Host& host, std::int32_t& result, std::string& trap) = 0;
};

class Engine {
 public:
  virtual ~Engine() = default;
  // Null, with `error`, where the module is not valid or memory is short.
  virtual std::shared_ptr<const Code> compile(const char* binary, std::size_t bytes, std::string& error) = 0;
  // For this thread. Null, with `error`, where memory is short.
  virtual std::unique_ptr<Instance> instantiate(const Code& code, std::string& error) = 0;
};

// The one of this process. NOT_FOUND, with the places that were searched, where there is none.
absl::StatusOr<Engine*> load_engine();

}  // namespace tessera::wasm
