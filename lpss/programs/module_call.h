// What a module calls while it runs: its side of Senses, Asker and Actor.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <span>
#include <string>

#include "lpss/programs/program.h"
#include "lpss/wasm/engine.h"

namespace tessera {

// One call of ask(), which has an asker, or run(), which has an actor.
class ModuleCall final : public wasm::Host {
 public:
  ModuleCall(const Senses& senses, std::span<double> values) : senses_(senses), values_(values) {}

  bool call(wasm::Import import, const double* arguments, double& result) override;

  Asker* asker = nullptr;
  Actor* actor = nullptr;
  std::span<std::uint8_t> memory;  // of the module
  std::uint32_t block_shift = 0;
  std::uint32_t dirty = 0;  // blocks of memory that were written here, as bits
  bool is_over = false;     // it has ended the call
  std::string fault;        // why; empty: what there is too much of says so itself

 private:
  bool end(std::string why);
  bool read(wasm::Import import, const double* arguments, double& result);
  bool ask(wasm::Import import, const double* arguments);
  bool act(wasm::Import import, const double* arguments);

  // A part of the memory; empty, and the call is over, where it is not all there.
  std::span<std::uint8_t> place(double address, std::size_t numbers);
  bool write(double address, std::span<const double> numbers);
  bool set_values(double address);
  bool write_senses(double address);
  bool write_finding(double ask, double place, double address);
  bool write_joint_finding(double ask, double place, double address);
  bool take(const absl::Status& status);
  absl::Status push(wasm::Import import, const double* arguments);
  absl::Status move_to(const double* arguments);
  absl::Status impulse(const double* arguments);
  absl::Status tell(const double* arguments);
  absl::Status drive(const double* arguments);
  absl::Status remove_joint(double id);
  // Of those that were found for its questions; null: it is not among them.
  const SensedJoint* found(double joint) const;

  const Senses& senses_;
  std::span<double> values_;
};

}  // namespace tessera
