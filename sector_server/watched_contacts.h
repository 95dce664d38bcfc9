// Which contacts a client watches.
#pragma once

#include <absl/container/flat_hash_set.h>
#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"
#include "tessera.pb.h"

namespace tessera {

// INVALID_ARGUMENT, with the field and the bound, for a request that cannot be meant.
absl::Status check_contacts(const v1::WatchContactsRequest& request);

class WatchedContacts {
 public:
  explicit WatchedContacts(const v1::WatchContactsRequest& request);

  // Those among the events of a tick, which are in the order of gather_events(); in the same order. The mask
  // is compared with the categories of both bodies, not with those of their parts. A body that is not known
  // any more, since it was removed or is elsewhere, has any category.
  std::vector<const ContactEvent*> among(const std::vector<ContactEvent>& events,
                                         const Partition& partition) const;

 private:
  bool wants(const ContactEvent* begin, const ContactEvent* end, const Partition& partition) const;

  const absl::flat_hash_set<std::uint64_t> ids_;  // empty: all
  const bool persisting_;
  const std::uint32_t mask_;  // 0: all
  const double impulse_min_;
};

}  // namespace tessera
