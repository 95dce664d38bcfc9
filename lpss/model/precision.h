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

// The names in files and options: "f32" and "f64". Empty for any other name.
const char* name_of(Precision precision);
std::optional<Precision> precision_named(std::string_view name);

}  // namespace tessera
