// Options of command lines whose text is not simply a number or a name.
#pragma once

#include <absl/status/statusor.h>

#include <CLI/App.hpp>
#include <string>
#include <utility>

namespace tessera {

// An option whose text `parse` (StatusOr<T> of a string) turns into `value`, T or optional<T>; text that it
// refuses is a usage error with its message.
template <typename Parse, typename T>
CLI::Option* add_parsed(CLI::App& command, const std::string& name, T& value, Parse parse,
                        const std::string& help) {
  return command.add_option_function<std::string>(
      name,
      [name, &value, parse](const std::string& text) {
        auto parsed = parse(text);
        if (!parsed.ok()) throw CLI::ValidationError(name, std::string(parsed.status().message()));
        value = *std::move(parsed);
      },
      help);
}

}  // namespace tessera
