// What a sector server says of itself, by which a coordinator gives it sectors: labels, which say where it is
// or what it has, such as zone=eu and rack=a7; and its capacity, how much of a world it takes by comparison
// with others.
#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <string>
#include <vector>

namespace tessera {

using Labels = std::vector<std::string>;  // each key=value, of a key only one

inline constexpr double kCapacityMin = 1e-3;
inline constexpr double kCapacityMax = 1e6;
inline constexpr std::size_t kLabelsMax = 16;
inline constexpr std::size_t kLabelBytesMax = 128;

// INVALID_ARGUMENT, with the label and the bound, where there are too many, one is too long or no key=value
// of letters, digits and . _ - /, or a key is there twice.
absl::Status check_labels(const Labels& labels);

// Whether `labels` has all of `required`.
bool has_all(const Labels& labels, const Labels& required);

}  // namespace tessera
