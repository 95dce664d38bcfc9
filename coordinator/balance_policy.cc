#include "coordinator/balance_policy.h"

#include <iterator>

#include "coordinator/policies.h"

namespace tessera {
namespace {

struct NamedPolicy {
  absl::string_view name;
  std::vector<Rank> (*divide)(const Division& division);
};

// In the order of BalancePolicy.
constexpr NamedPolicy kPolicies[] = {{"curve", divide_curve},
                                     {"k-means", divide_k_means},
                                     {"hulls", divide_hulls},
                                     {"graph", divide_graph},
                                     {"grid", divide_grid}};
static_assert(std::size(kPolicies) == std::size(kBalancePolicies));

}  // namespace

absl::string_view name_of(BalancePolicy policy) { return kPolicies[static_cast<std::size_t>(policy)].name; }

std::optional<BalancePolicy> parse_balance_policy(absl::string_view name) {
  for (const BalancePolicy policy : kBalancePolicies) {
    if (name_of(policy) == name) return policy;
  }
  return std::nullopt;
}

std::vector<std::string> balance_policy_names() {
  std::vector<std::string> names;
  for (const NamedPolicy& policy : kPolicies) names.emplace_back(policy.name);
  return names;
}

std::vector<Rank> divide(BalancePolicy policy, const Division& division) {
  return kPolicies[static_cast<std::size_t>(policy)].divide(division);
}

}  // namespace tessera
