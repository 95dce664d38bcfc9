// A program whose functions are in a WebAssembly module.
#pragma once

#include <absl/status/status.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "lpss/programs/module_text.h"
#include "lpss/programs/program.h"
#include "lpss/wasm/engine.h"
#include "lpss/wasm/sandbox.h"

namespace tessera {

class ModuleCall;

// Each thread that runs it makes an instance of the module, with a memory of its own.
class ModuleProgram final : public Program, public ProgramModule {
 public:
  ModuleProgram(ProgramModule module, ModuleText text, wasm::SandboxedModule code);
  ModuleProgram(const ModuleProgram&) = delete;
  ModuleProgram& operator=(const ModuleProgram&) = delete;

  absl::string_view kind() const override { return ProgramModule::kind; }
  absl::string_view name() const { return text_.name; }
  absl::string_view summary() const override { return text_.summary; }
  std::span<const NumberSpec> parameters() const override { return parameters_; }
  std::span<const NumberSpec> inputs() const override { return inputs_; }
  std::span<const NumberSpec> values() const override { return values_; }
  std::optional<Motion> motion() const override { return text_.motion; }
  bool removes_joints() const override { return code_.removes_joints; }
  bool acts_on_others() const override { return true; }

  void ask(const Senses& senses, std::span<const double> values, Asker& asker) const override;
  void run(const Senses& senses, std::span<double> values, Actor& actor) const override;

  // NOT_FOUND where there is no engine, INTERNAL where it does not take the module.
  absl::Status can_run() const;
  bool asks() const { return code_.has_ask; }
  // Of its last call on this thread.
  std::int64_t instructions() const;

 private:
  absl::StatusOr<wasm::Instance*> instance() const;
  absl::StatusOr<std::unique_ptr<wasm::Instance>> new_instance() const;
  // Why the instance is stopped; empty: it is not.
  std::string call(wasm::Export function, ModuleCall& call) const;

  ModuleText text_;
  wasm::SandboxedModule code_;
  std::vector<NumberSpec> parameters_;
  std::vector<NumberSpec> inputs_;
  std::vector<NumberSpec> values_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const wasm::Code> compiled_;  // null: it has not been needed yet
  std::shared_ptr<const bool> alive_ = std::make_shared<const bool>(true);
};

}  // namespace tessera
