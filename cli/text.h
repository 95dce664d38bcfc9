// Numbers and vectors as people read them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "lpss/model/tick_counts.h"

namespace tessera::cli {

// "1,234,567".
std::string grouped(std::uint64_t number);

// "islands across seams".
std::string title_of(const TickCounter& counter);

// "0.123, 4.560, 7.890" with three decimals.
std::string to_string(const Eigen::Vector3d& vector);

}  // namespace tessera::cli
