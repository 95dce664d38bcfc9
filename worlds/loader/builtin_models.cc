#include "worlds/loader/builtin_models.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <optional>

#include "worlds/loader/fuel_cache.h"

namespace tessera {
namespace {

constexpr char kSun[] = "<sdf version='1.9'><light name='sun' type='directional'/></sdf>";

// The friction is high, so that that of what stands on it counts.
constexpr char kGroundPlane[] =
    "<sdf version='1.9'><model name='ground_plane'><static>true</static><link name='link'>"
    "<collision name='collision'><geometry><plane><normal>0 0 1</normal><size>100 "
    "100</size></plane></geometry>"
    "<surface><friction><ode><mu>100</mu></ode></friction></surface></collision></link></model></sdf>";

std::string name_in(const std::string& uri) {
  if (const std::optional<FuelUri> fuel = fuel_uri(uri)) return fuel->file.empty() ? fuel->name : "";
  absl::string_view name = uri;
  if (!absl::ConsumePrefix(&name, "model://")) return "";
  absl::ConsumePrefix(&name, "/");
  absl::ConsumeSuffix(&name, "/");
  return std::string(name);
}

}  // namespace

const char* builtin_model(const std::string& uri) {
  const std::string name = absl::StrReplaceAll(absl::AsciiStrToLower(name_in(uri)), {{" ", "_"}});
  if (name == "sun") return kSun;
  return name == "ground_plane" ? kGroundPlane : nullptr;
}

}  // namespace tessera
