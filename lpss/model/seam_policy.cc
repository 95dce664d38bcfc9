#include "lpss/model/seam_policy.h"

namespace tessera {

const char* name_of(SeamPolicy seams) { return seams == SeamPolicy::kIsland ? "island" : "clone"; }

std::optional<SeamPolicy> seams_named(std::string_view name) {
  for (const SeamPolicy seams : kSeamPolicies) {
    if (name == name_of(seams)) return seams;
  }
  return std::nullopt;
}

}  // namespace tessera
