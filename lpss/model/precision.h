// The number types that an engine computes with.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace tessera {

enum class Precision : std::uint8_t { kFloat32, kFloat64 };

inline constexpr std::array kPrecisions = {Precision::kFloat32, Precision::kFloat64};
constexpr const auto& all_of(Precision) { return kPrecisions; }

// As files and people write it: "f32" and "f64". Nothing for another name.
const char* name_of(Precision precision);
std::optional<Precision> precision_named(std::string_view name);

}  // namespace tessera
