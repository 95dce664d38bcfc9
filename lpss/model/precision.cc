#include "lpss/model/precision.h"

namespace tessera {

const char* name_of(Precision precision) { return precision == Precision::kFloat32 ? "f32" : "f64"; }

std::optional<Precision> precision_named(std::string_view name) {
  for (const Precision precision : kPrecisions) {
    if (name == name_of(precision)) return precision;
  }
  return std::nullopt;
}

}  // namespace tessera
