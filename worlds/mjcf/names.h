// Names of a model, each once.
#pragma once

#include <string>

#include "absl/container/flat_hash_set.h"

namespace tessera::mjcf {

// `name`, or else `otherwise`, as it can be in a world: UTF-8 without "::", and not too long.
std::string fit_name(const std::string& name, const std::string& otherwise);

class Names {
 public:
  explicit Names(std::string model) : model_(std::move(model)) {}

  // "model::name"; with a number where that is taken.
  std::string unique(const std::string& name);

 private:
  std::string model_;
  absl::flat_hash_set<std::string> taken_;
};

}  // namespace tessera::mjcf
