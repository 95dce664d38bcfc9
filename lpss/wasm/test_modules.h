// For tests: modules from the text format, and another engine that runs them.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "lpss/wasm/engine.h"

namespace tessera::wasm {

// Exits where the text is wrong.
std::string assembled(std::string_view text);

// A custom section, to follow a module.
std::string custom_section(std::string_view name, std::string_view contents);

// A module whose program has no numbers.
std::string test_module(std::string_view text, std::string_view description = "program | test | Tests.\n");

// The interpreter of wabt.
std::unique_ptr<Engine> wabt_engine();

}  // namespace tessera::wasm
