// How contacts across borders between sectors are solved.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace tessera {

enum class SeamPolicy : std::uint8_t {
  kIsland,  // contacts are found in sectors and solved in one order over all of them
  kClone,   // the paper's Cloning Manager: every sector solves its own bodies and its clones
};

inline constexpr std::array kSeamPolicies = {SeamPolicy::kIsland, SeamPolicy::kClone};
constexpr const auto& all_of(SeamPolicy) { return kSeamPolicies; }

// The names in files and options: "island" and "clone". Empty for any other name.
const char* name_of(SeamPolicy seams);
std::optional<SeamPolicy> seams_named(std::string_view name);

}  // namespace tessera
