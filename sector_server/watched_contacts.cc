#include "sector_server/watched_contacts.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <optional>

#include "lpss/model/limits.h"

namespace tessera {
namespace {

std::optional<std::uint32_t> category_of(const Partition& partition, BodyId id) {
  if (const auto home = partition.bodies.find(id); home != partition.bodies.end())
    return home->second->properties.category;
  if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end())
    return replica->second->properties.category;
  if (const BodyRecord* fixed = partition.statics.find(id); fixed != nullptr)
    return fixed->properties.category;
  return std::nullopt;
}

}  // namespace

absl::Status check_contacts(const v1::WatchContactsRequest& request) {
  const double least = request.impulse_min();
  if (std::isfinite(least) && least >= 0 && least <= kImpulseMax) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("impulse_min = ", least, " must be from 0 to ", kImpulseMax, " N s"));
}

WatchedContacts::WatchedContacts(const v1::WatchContactsRequest& request)
    : ids_(request.ids().begin(), request.ids().end()),
      persisting_(request.persisting()),
      mask_(request.mask()),
      impulse_min_(request.impulse_min()) {}

// Of the patches of one pair.
bool WatchedContacts::wants(const ContactEvent* begin, const ContactEvent* end,
                            const Partition& partition) const {
  if (!ids_.empty() && !ids_.contains(begin->a.value) && !ids_.contains(begin->b.value)) return false;
  if (impulse_min_ > 0) {
    double impulse = 0;
    for (const ContactEvent* patch = begin; patch != end; ++patch) impulse += patch->impulse;
    if (begin->phase == ContactPhase::kEnd || impulse < impulse_min_) return false;
  } else if (begin->phase == ContactPhase::kPersist && !persisting_) {
    return false;
  }
  const auto matches = [&](BodyId id) { return (category_of(partition, id).value_or(mask_) & mask_) != 0; };
  return mask_ == 0 || matches(begin->a) || matches(begin->b);
}

std::vector<const ContactEvent*> WatchedContacts::among(const std::vector<ContactEvent>& events,
                                                        const Partition& partition) const {
  std::vector<const ContactEvent*> found;
  const ContactEvent* const last = events.data() + events.size();
  for (const ContactEvent* begin = events.data(); begin != last;) {
    const auto is_of_pair = [begin](const ContactEvent& event) {
      return event.a == begin->a && event.b == begin->b && event.phase == begin->phase &&
             event.trigger == begin->trigger;
    };
    const ContactEvent* end = begin + 1;
    while (end != last && is_of_pair(*end)) ++end;
    if (wants(begin, end, partition)) {
      for (const ContactEvent* patch = begin; patch != end; ++patch) found.push_back(patch);
    }
    begin = end;
  }
  return found;
}

}  // namespace tessera
