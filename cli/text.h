// Numbers and vectors as people read them.
#pragma once

#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "lpss/model/tick_counts.h"

namespace tessera::cli {

// "1,234,567".
std::string grouped(std::uint64_t number);

// "islands across seams".
std::string title_of(const TickCounter& counter);

// "0.123, 4.560, 7.890" with three decimals.
std::string to_string(const Eigen::Vector3d& vector);

// A message of the coordinator in terms of the command line: "set `replace`" becomes "add --replace".
std::string in_options(absl::string_view message);

// What a world file has that is not simulated, and its faults that were mended: a line each.
std::string file_notes(const std::vector<std::string>& notices, const std::vector<std::string>& repairs);

}  // namespace tessera::cli
