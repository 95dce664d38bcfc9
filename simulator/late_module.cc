#include "simulator/late_module.h"

#include <algorithm>
#include <string>

#include "lpss/base/invariant.h"
#include "lpss/programs/module.h"

namespace tessera {
namespace {

constexpr unsigned char kBytes[] = {
#include "simulator/flee_bytes.inc"
};

std::shared_ptr<const ProgramModule> loaded() {
  absl::StatusOr<std::shared_ptr<const ProgramModule>> module =
      load_module(std::string(std::begin(kBytes), std::end(kBytes)));
  invariant(module.ok(), "the module of worlds/flee.sdf can be read");
  return can_run({*module}).ok() ? *std::move(module) : nullptr;
}

}  // namespace

const std::shared_ptr<const ProgramModule>& late_module() {
  static const std::shared_ptr<const ProgramModule> kModule = loaded();
  return kModule;
}

void bring_late_module(v1::Model& model) {
  if (!late_module()) return;
  const auto is_late = [](const v1::Program& program) { return program.kind() == late_module()->kind; };
  const auto has_late = [&](const v1::Body& body) { return std::ranges::any_of(body.programs(), is_late); };
  if (std::ranges::any_of(model.bodies(), has_late)) model.add_modules(late_module()->bytes);
}

}  // namespace tessera
