#include "worlds/loader/fuel_cache.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <system_error>

namespace tessera {
namespace {

using std::filesystem::path;

constexpr std::array<const char*, 2> kCacheVariables = {"GZ_FUEL_CACHE_PATH", "IGN_FUEL_CACHE_PATH"};
constexpr std::array<const char*, 2> kCachesAtHome = {".gz/fuel", ".ignition/fuel"};
// One server: its name of today, and that of before.
constexpr std::array<absl::string_view, 2> kServers = {"fuel.gazebosim.org", "fuel.ignitionrobotics.org"};
// Its pages for people, whose addresses find their way into files: https://app.SERVER/OWNER/fuel/models/NAME.
constexpr std::array<absl::string_view, 2> kPages = {"app.gazebosim.org", "app.ignitionrobotics.org"};
constexpr char kModels[] = "models";
constexpr absl::string_view kNewest = "tip";

// "Ground%20Plane" as "Ground Plane".
std::string decoded(absl::string_view text) {
  std::string result;
  for (std::size_t n = 0; n < text.size(); ++n) {
    std::uint32_t byte = 0;
    if (text[n] == '%' && n + 2 < text.size() && absl::SimpleHexAtoi(text.substr(n + 1, 2), &byte)) {
      result += static_cast<char>(byte);
      n += 2;
    } else {
      result += text[n];
    }
  }
  return result;
}

bool is_name_of_file(const std::string& part) {
  return !part.empty() && part != "." && part != ".." && !absl::StrContains(part, '/') &&
         !absl::StrContains(part, '\0');
}

bool is_number(absl::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) { return absl::ascii_isdigit(c); });
}

// The folder of the newest version in the folder of a model; that folder itself, if there is none.
path newest_version(const path& model) {
  std::error_code error;
  std::uint64_t newest = 0;
  path result = model;
  for (std::filesystem::directory_iterator entry(model, error), end; !error && entry != end;
       entry.increment(error)) {
    std::uint64_t version = 0;
    const std::string name = entry->path().filename().string();
    if (!is_number(name) || !absl::SimpleAtoi(name, &version) || version < newest) continue;
    newest = version;
    result = entry->path();
  }
  return result;
}

}  // namespace

bool is_remote(const std::string& uri) {
  return absl::StartsWith(uri, "http://") || absl::StartsWith(uri, "https://");
}

std::optional<FuelUri> fuel_uri(const std::string& uri) {
  if (!is_remote(uri)) return std::nullopt;
  std::vector<std::string> parts;
  for (const absl::string_view part :
       absl::StrSplit(uri.substr(uri.find("//") + 2), '/', absl::SkipEmpty())) {
    parts.push_back(decoded(part));
    if (!is_name_of_file(parts.back())) return std::nullopt;
  }
  const auto models = std::ranges::find(parts, kModels);
  if (models - parts.begin() < 2 || parts.end() - models < 2) return std::nullopt;
  FuelUri result;
  const auto page = std::ranges::find(kPages, parts.front());
  const bool is_page = page != kPages.end() && *(models - 1) == "fuel" && models - parts.begin() > 2;
  result.server =
      is_page ? std::string(kServers.at(static_cast<std::size_t>(page - kPages.begin()))) : parts.front();
  result.owner = *(models - (is_page ? 2 : 1));
  auto rest = models + 1;
  result.name = *rest++;
  if (rest != parts.end() && (is_number(*rest) || *rest == kNewest)) {
    if (*rest != kNewest) result.version = *rest;
    ++rest;
  }
  if (rest == parts.end()) return result;
  if (*rest != "files") return std::nullopt;
  for (++rest; rest != parts.end(); ++rest) result.file /= *rest;
  return result;
}

std::vector<path> fuel_caches() {
  std::vector<path> result;
  for (const char* variable : kCacheVariables) {
    if (const char* folder = std::getenv(variable); folder != nullptr && *folder != '\0')
      result.emplace_back(folder);
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    for (const char* cache : kCachesAtHome) result.push_back(path(home) / cache);
  }
  return result;
}

std::vector<path> places_in_fuel_caches(const FuelUri& uri) {
  std::vector<absl::string_view> servers{uri.server};
  if (std::ranges::find(kServers, uri.server) != kServers.end())
    servers.assign(kServers.begin(), kServers.end());
  std::vector<path> folders{path(absl::AsciiStrToLower(uri.owner)) / kModels /
                            absl::AsciiStrToLower(uri.name)};
  if (path as_written = path(uri.owner) / kModels / uri.name; as_written != folders.front())
    folders.push_back(std::move(as_written));
  std::vector<path> result;
  for (const path& cache : fuel_caches()) {
    for (const absl::string_view server : servers) {
      for (const path& folder : folders) {
        const path model = cache / std::string(server) / folder;
        const path version = uri.version.empty() ? newest_version(model) : model / uri.version;
        result.push_back(uri.file.empty() ? version : version / uri.file);
      }
    }
  }
  return result;
}

}  // namespace tessera
