#include "lpss/programs/module_program.h"

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/programs/module_call.h"
#include "lpss/wasm/limits.h"

namespace tessera {
namespace {

constexpr std::size_t kTrapTextMax = 128;
// What the engine says where this machine fails, and not the module.
constexpr absl::string_view kMachineFailures[] = {"out of memory", "too much recursion"};

// An instance of a module on this thread.
struct OfThread {
  std::weak_ptr<const bool> alive;  // of its module
  std::unique_ptr<wasm::Instance> instance;
};

thread_local absl::flat_hash_map<const void*, OfThread> instances_of_thread;

std::vector<NumberSpec> table_of(const std::vector<ModuleNumber>& numbers) {
  std::vector<NumberSpec> table;
  for (const ModuleNumber& n : numbers)
    table.push_back({n.name, n.unit, n.first, n.least, n.most, n.meaning});
  return table;
}

// What a call has written becomes as it was at first. A write may reach a few bytes into the next block.
void restore(std::uint8_t* memory, const std::string& first, std::uint32_t shift, std::uint32_t dirty) {
  constexpr std::size_t kNumberMax = 8;
  const std::size_t block = std::size_t{1} << shift;
  for (; dirty != 0; dirty &= dirty - 1) {
    const std::size_t begin = static_cast<std::size_t>(std::countr_zero(dirty)) << shift;
    if (begin >= first.size()) return;
    const std::size_t end = std::min(begin + block + kNumberMax, first.size());
    std::memcpy(memory + begin, first.data() + begin, end - begin);
  }
}

// Calls nothing of the host.
class NoHost final : public wasm::Host {
 public:
  bool call(wasm::Import /*import*/, const double* /*arguments*/, double& /*result*/) override {
    return false;
  }
};

std::int32_t number_of(wasm::Instance& instance, wasm::Export which) {
  NoHost host;
  std::int32_t number = 0;
  std::string trap;
  instance.call(which, host, number, trap);
  return number;
}

}  // namespace

ModuleProgram::ModuleProgram(ProgramModule module, ModuleText text, wasm::SandboxedModule code)
    : ProgramModule(std::move(module)),
      text_(std::move(text)),
      code_(std::move(code)),
      parameters_(table_of(text_.parameters)),
      inputs_(table_of(text_.inputs)),
      values_(table_of(text_.values)) {}

absl::StatusOr<wasm::Instance*> ModuleProgram::instance() const {
  OfThread& own = instances_of_thread[this];
  // Another module may have lived at this place.
  if (own.instance && own.alive.lock() == alive_) return own.instance.get();
  absl::StatusOr<std::unique_ptr<wasm::Instance>> made = new_instance();
  if (!made.ok()) return made.status();
  own = {alive_, *std::move(made)};
  wasm::Instance* const result = own.instance.get();
  absl::erase_if(instances_of_thread, [](const auto& one) { return one.second.alive.expired(); });
  return result;
}

absl::StatusOr<std::unique_ptr<wasm::Instance>> ModuleProgram::new_instance() const {
  const absl::StatusOr<wasm::Engine*> engine = wasm::load_engine();
  if (!engine.ok()) return engine.status();
  std::string error;
  std::unique_ptr<wasm::Instance> made;
  {
    const std::lock_guard lock(mutex_);
    if (!compiled_) compiled_ = (*engine)->compile(code_.binary.data(), code_.binary.size(), error);
  }
  if (compiled_) made = (*engine)->instantiate(*compiled_, error);
  if (made) return made;
  return absl::InternalError(absl::StrCat("program ", kind(), ": the engine does not take it: ", error));
}

absl::Status ModuleProgram::can_run() const { return instance().status(); }

std::string ModuleProgram::call(wasm::Export function, ModuleCall& call) const {
  const absl::StatusOr<wasm::Instance*> on_thread = instance();
  invariant(on_thread.ok(), "a server runs the modules of its world");
  wasm::Instance& instance = **on_thread;
  call.memory = {instance.memory(), code_.memory.size()};
  call.block_shift = code_.block_shift;
  std::int32_t dirty = 0;
  std::string trap;
  const bool is_done = instance.call(function, call, dirty, trap);
  if (is_done) {
    restore(call.memory.data(), code_.memory, code_.block_shift,
            static_cast<std::uint32_t>(dirty) | call.dirty);
    return "";
  }
  std::ranges::copy(code_.memory, call.memory.begin());
  invariant(std::ranges::find(kMachineFailures, trap) == std::end(kMachineFailures),
            "a module has the memory and the stack that it may use");
  if (call.is_over) return call.fault;
  if (number_of(instance, wasm::Export::kLeft) < 0)
    return absl::StrCat("it takes more than ", wasm::kInstructionsMax, " instructions in a call");
  if (number_of(instance, wasm::Export::kDepth) < 0)
    return absl::StrCat("its calls take more than ", wasm::kStackMax, " numbers of the stack");
  return absl::StrCat("it traps: ", trap.substr(0, kTrapTextMax));
}

void ModuleProgram::ask(const Senses& senses, std::span<const double> values, Asker& asker) const {
  if (!code_.has_ask) return;
  std::vector<double> copy(values.begin(), values.end());
  ModuleCall call(senses, copy);
  call.asker = &asker;
  if (const std::string fault = this->call(wasm::Export::kAsk, call); !fault.empty()) asker.fail(fault);
}

void ModuleProgram::run(const Senses& senses, std::span<double> values, Actor& actor) const {
  ModuleCall call(senses, values);
  call.actor = &actor;
  if (const std::string fault = this->call(wasm::Export::kRun, call); !fault.empty()) actor.fail(fault);
}

std::int64_t ModuleProgram::instructions() const {
  const absl::StatusOr<wasm::Instance*> on_thread = instance();
  return on_thread.ok() ? std::int64_t{wasm::kInstructionsMax} - number_of(**on_thread, wasm::Export::kLeft)
                        : 0;
}

}  // namespace tessera
