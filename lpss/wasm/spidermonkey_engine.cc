// The engine of WebAssembly modules: SpiderMonkey, which has one context for each thread.
#include <js/ArrayBuffer.h>
#include <js/CallAndConstruct.h>
#include <js/ContextOptions.h>
#include <js/Conversions.h>
#include <js/Exception.h>
#include <js/Initialization.h>
#include <js/Object.h>
#include <js/PropertyAndElement.h>
#include <js/WasmModule.h>
#include <jsapi.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <string_view>
#include <utility>

#include "lpss/wasm/engine.h"

namespace tessera::wasm {
namespace {

constexpr std::uint32_t kHeapBytesMax = 64u << 20;  // of a thread, without code and memories of modules
// Of a thread's stack: that is left for others, and that counts of a stack without bounds.
constexpr std::size_t kStackKept = 256u << 10;
constexpr std::size_t kStackCounted = 8u << 20;

std::atomic<bool> is_shut_down = false;

// Started once. At the end of the process, helper threads of the library must end before what they use; other
// threads may still have contexts, which are left as they are.
class Library {
 public:
  static bool is_ready() {
    static const Library kLibrary;
    return kLibrary.is_ready_;
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

 private:
  // Each memory would reserve 6 GiB of addresses, to save checks of bounds.
  Library() : is_ready_(JS_Init() && JS::DisableWasmHugeMemory()) {}
  ~Library() {
    is_shut_down = true;
    JS_ShutDown();
  }
  bool is_ready_;
};

std::size_t stack_bytes() {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return kStackCounted;
  std::size_t bytes = 0;
  pthread_attr_getstacksize(&attributes, &bytes);
  pthread_attr_destroy(&attributes);
  return std::clamp(bytes, 2 * kStackKept, kStackCounted);
}

// The context of a thread, with a global object for all modules.
class ThreadContext {
 public:
  // Null where memory is short.
  static std::shared_ptr<ThreadContext> here() {
    thread_local std::weak_ptr<ThreadContext> current;
    std::shared_ptr<ThreadContext> context = current.lock();
    if (context) return context;
    context = std::make_shared<ThreadContext>();
    if (!context->start()) return nullptr;
    current = context;
    return context;
  }

  ThreadContext() = default;
  ThreadContext(const ThreadContext&) = delete;
  ThreadContext& operator=(const ThreadContext&) = delete;
  ~ThreadContext() {
    if (cx_ == nullptr || is_shut_down) return;
    global_.reset();
    JS_DestroyContext(cx_);
  }

  JSContext* cx() const { return cx_; }
  JSObject* global() const { return global_; }
  Host* host = nullptr;  // of the call that runs

  static ThreadContext& of(JSContext* cx) { return *static_cast<ThreadContext*>(JS_GetContextPrivate(cx)); }

 private:
  bool start() {
    if (!Library::is_ready()) return false;
    cx_ = JS_NewContext(kHeapBytesMax);
    if (cx_ == nullptr) return false;
    JS_SetContextPrivate(cx_, this);
    JS_SetNativeStackQuota(cx_, stack_bytes() - kStackKept);
    // Code is compiled once, by the compiler that optimises.
    JS::ContextOptionsRef(cx_).setWasm(true).setWasmBaseline(false).setWasmIon(true);
    if (!JS::InitSelfHostedCode(cx_)) return false;
    static const JSClass kGlobalClass = {"tessera", JSCLASS_GLOBAL_FLAGS, &JS::DefaultGlobalClassOps};
    const JS::RealmOptions options;
    global_.init(cx_, JS_NewGlobalObject(cx_, &kGlobalClass, nullptr, JS::FireOnNewGlobalHook, options));
    return global_.get() != nullptr;
  }

  JSContext* cx_ = nullptr;
  JS::PersistentRootedObject global_;
};

// A function of the host.
template <std::size_t n>
bool call_host(JSContext* cx, unsigned number, JS::Value* values) {
  constexpr const ImportSpec& kSpec = kImports[n];
  const JS::CallArgs given = JS::CallArgsFromVp(number, values);
  std::array<double, kImportParametersMax> arguments{};
  for (unsigned a = 0; a < kSpec.parameters.size(); ++a) arguments[a] = given[a].toNumber();
  double result = 0;
  if (!ThreadContext::of(cx).host->call(static_cast<Import>(n), arguments.data(), result)) return false;
  given.rval().setUndefined();
  if (!kSpec.result.empty()) given.rval().setNumber(result);
  return true;
}

template <std::size_t... n>
bool define_imports(JSContext* cx, JS::HandleObject object, std::index_sequence<n...> /*numbers*/) {
  return (JS_DefineFunction(cx, object, kImports[n].name.data(), call_host<n>,
                            static_cast<unsigned>(kImports[n].parameters.size()), 0) &&
          ...);
}

// What an exception says, without its kind.
std::string taken_exception(JSContext* cx) {
  JS::RootedValue exception(cx);
  if (!JS_GetPendingException(cx, &exception)) return "";
  JS_ClearPendingException(cx);
  const JS::RootedString text(cx, JS::ToString(cx, exception));
  const JS::UniqueChars chars = text ? JS_EncodeStringToUTF8(cx, text) : nullptr;
  if (!chars) {
    JS_ClearPendingException(cx);
    return "out of memory";
  }
  const std::string_view said = chars.get();
  const std::size_t colon = said.find(": ");
  return std::string(colon == std::string_view::npos ? said : said.substr(colon + 2));
}

// The same, of something that failed.
std::string taken_error(JSContext* cx) {
  const std::string said = taken_exception(cx);
  return said.empty() ? "memory is short" : said;
}

// Of WebAssembly.
bool get_constructor(JSContext* cx, JSObject* global, const char* name, JS::MutableHandleValue constructor) {
  const JS::RootedObject global_object(cx, global);
  JS::RootedValue assembly(cx);
  if (!JS_GetProperty(cx, global_object, "WebAssembly", &assembly) || !assembly.isObject()) return false;
  const JS::RootedObject space(cx, &assembly.toObject());
  return JS_GetProperty(cx, space, name, constructor);
}

// Null where it is not valid.
RefPtr<JS::WasmModule> compiled(JSContext* cx, JSObject* global, const char* binary, std::size_t bytes) {
  const JS::RootedObject buffer(cx, JS::NewArrayBuffer(cx, bytes));
  if (!buffer) return nullptr;
  {
    const JS::AutoCheckCannotGC no_gc;
    bool is_shared = false;
    std::memcpy(JS::GetArrayBufferData(buffer, &is_shared, no_gc), binary, bytes);
  }
  JS::RootedValue make_module(cx);
  if (!get_constructor(cx, global, "Module", &make_module)) return nullptr;
  JS::RootedObject module(cx);
  JS::RootedValueArray<1> source(cx);
  source[0].setObject(*buffer);
  if (!JS::Construct(cx, make_module, source, &module)) return nullptr;
  return JS::GetWasmModule(module);
}

class SharedCode final : public Code {
 public:
  explicit SharedCode(RefPtr<JS::WasmModule> module) : module_(std::move(module)) {}
  const JS::WasmModule& module() const { return *module_; }

 private:
  RefPtr<JS::WasmModule> module_;
};

class ModuleInstance final : public Instance {
 public:
  explicit ModuleInstance(std::shared_ptr<ThreadContext> context) : context_(std::move(context)) {}
  ModuleInstance(const ModuleInstance&) = delete;
  ModuleInstance& operator=(const ModuleInstance&) = delete;
  ~ModuleInstance() override {
    for (JS::PersistentRootedValue& function : functions_) function.reset();
    buffer_.reset();
  }

  bool start(const JS::WasmModule& code, std::string& error) {
    JSContext* const cx = context_->cx();
    const JSAutoRealm realm(cx, context_->global());
    if (instantiate(cx, code) && memory_ != nullptr) return true;
    error = taken_error(cx);
    return false;
  }

  std::uint8_t* memory() override { return memory_; }

  bool call(Export function, Host& host, std::int32_t& result, std::string& trap) override {
    JSContext* const cx = context_->cx();
    const JSAutoRealm realm(cx, context_->global());
    Host* const outer = std::exchange(context_->host, &host);
    JS::RootedValue value(cx);
    const bool is_done = JS_CallFunctionValue(cx, nullptr, functions_[static_cast<std::size_t>(function)],
                                              JS::HandleValueArray::empty(), &value);
    context_->host = outer;
    if (is_done) {
      result = value.toInt32();
    } else {
      trap = taken_exception(cx);
    }
    return is_done;
  }

 private:
  bool instantiate(JSContext* cx, const JS::WasmModule& code) {
    const JS::RootedObject module(cx, code.createObject(cx));
    JS::RootedValue make_instance(cx);
    if (!module || !get_constructor(cx, context_->global(), "Instance", &make_instance)) return false;
    const JS::RootedObject imports(cx, JS_NewPlainObject(cx));
    const JS::RootedObject host(cx, JS_NewPlainObject(cx));
    if (!imports || !host || !define_imports(cx, host, std::make_index_sequence<std::size(kImports)>()))
      return false;
    const JS::RootedValue host_value(cx, JS::ObjectValue(*host));
    if (!JS_SetProperty(cx, imports, "tessera", host_value)) return false;
    JS::RootedObject instance(cx);
    JS::RootedValueArray<2> parts(cx);
    parts[0].setObject(*module);
    parts[1].setObject(*imports);
    return JS::Construct(cx, make_instance, parts, &instance) && take_exports(cx, instance);
  }

  bool take_exports(JSContext* cx, JS::HandleObject instance) {
    JS::RootedValue value(cx);
    if (!JS_GetProperty(cx, instance, "exports", &value) || !value.isObject()) return false;
    const JS::RootedObject exports(cx, &value.toObject());
    for (std::size_t n = 0; n < kExports.size(); ++n) {
      if (!JS_GetProperty(cx, exports, kExports[n].data(), &value)) return false;
      functions_[n].init(cx, value);
    }
    if (!JS_GetProperty(cx, exports, kMemoryExport.data(), &value) || !value.isObject()) return false;
    const JS::RootedObject memory(cx, &value.toObject());
    if (!JS_GetProperty(cx, memory, "buffer", &value) || !value.isObject()) return false;
    buffer_.init(cx, &value.toObject());
    std::size_t bytes = 0;
    bool is_shared = false;
    JS::GetArrayBufferLengthAndData(buffer_, &bytes, &is_shared, &memory_);
    return true;
  }

  std::shared_ptr<ThreadContext> context_;
  std::array<JS::PersistentRootedValue, kExports.size()> functions_;
  JS::PersistentRootedObject buffer_;  // of its memory
  std::uint8_t* memory_ = nullptr;
};

class SpiderMonkey final : public Engine {
 public:
  std::shared_ptr<const Code> compile(const char* binary, std::size_t bytes, std::string& error) override {
    const std::shared_ptr<ThreadContext> context = context_here(error);
    if (!context) return nullptr;
    const JSAutoRealm realm(context->cx(), context->global());
    RefPtr<JS::WasmModule> module = compiled(context->cx(), context->global(), binary, bytes);
    if (module) return std::make_shared<const SharedCode>(std::move(module));
    error = taken_error(context->cx());
    return nullptr;
  }

  std::unique_ptr<Instance> instantiate(const Code& code, std::string& error) override {
    std::shared_ptr<ThreadContext> context = context_here(error);
    if (!context) return nullptr;
    auto instance = std::make_unique<ModuleInstance>(std::move(context));
    if (!instance->start(static_cast<const SharedCode&>(code).module(), error)) return nullptr;
    return instance;
  }

 private:
  static std::shared_ptr<ThreadContext> context_here(std::string& error) {
    std::shared_ptr<ThreadContext> context = ThreadContext::here();
    if (!context) error = "the engine does not start";
    return context;
  }
};

}  // namespace
}  // namespace tessera::wasm

extern "C" __attribute__((visibility("default"))) const char* tessera_wasm_interface() {
  return TESSERA_WASM_INTERFACE;
}
extern "C" __attribute__((visibility("default"))) tessera::wasm::Engine* tessera_wasm_engine() {
  static tessera::wasm::SpiderMonkey engine;
  return &engine;
}
