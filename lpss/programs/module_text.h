// How a module describes its program: lines of its custom section "tessera".
//
//   program | flee | Runs away from a body.
//   motion | dynamic
//   parameter | speed | m/s | 2 | 0 | 100 | How fast it runs.
//   input | from | body | 0 | 0 | 9e15 | The body that it flees.
//   value | distance | m | 0 | How far away that was.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "lpss/model/body.h"

namespace tessera {

struct ModuleNumber {
  std::string name;
  std::string unit;
  double first = 0;
  double least = 0;
  double most = 0;
  std::string meaning;
};

struct ModuleText {
  std::string name;
  std::string summary;
  std::optional<Motion> motion;
  std::vector<ModuleNumber> parameters;
  std::vector<ModuleNumber> inputs;
  std::vector<ModuleNumber> values;
};

// INVALID_ARGUMENT, naming the line.
absl::StatusOr<ModuleText> read_module_text(const std::string& text);

}  // namespace tessera
