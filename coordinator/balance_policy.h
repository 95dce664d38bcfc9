// The policies by which a world is divided among its servers.
#pragma once

#include <absl/strings/string_view.h>

#include <optional>
#include <string>
#include <vector>

namespace tessera {

enum class BalancePolicy { kCurve, kKMeans, kHulls, kGraph, kGrid };

inline constexpr BalancePolicy kBalancePolicies[] = {BalancePolicy::kCurve, BalancePolicy::kKMeans,
                                                     BalancePolicy::kHulls, BalancePolicy::kGraph,
                                                     BalancePolicy::kGrid};

// "curve", "k-means", "hulls", "graph", "grid".
absl::string_view name_of(BalancePolicy policy);
std::optional<BalancePolicy> parse_balance_policy(absl::string_view name);
// Of all of them.
std::vector<std::string> balance_policy_names();

// Whether it is worth asking again when the load has changed.
inline bool follows_load(BalancePolicy policy) { return policy != BalancePolicy::kGrid; }

}  // namespace tessera
