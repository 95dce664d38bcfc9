// The coordinator's record of a world's frames: names of places on bodies, which go with their bodies.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/btree_set.h>

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/undo.h"
#include "lpss/model/world_description.h"
#include "lpss/snapshot/world_catalogue.h"

namespace tessera {

class FrameRegistry {
 public:
  struct Entry {
    BodyId body;
    Pose pose;  // in the body frame
  };

  // Of a valid world, with the records of its bodies.
  FrameRegistry(std::span<const FrameDescription> frames, std::span<const BodyRecord> records);

  // Of a valid catalogue, and back.
  explicit FrameRegistry(const WorldCatalogue& catalogue);
  void describe(WorldCatalogue& catalogue) const;

  // Null if there is none.
  const Entry* find(std::string_view name) const;

  // At most `limit` frames whose names begin with `prefix`, ascending by name; valid until one is removed.
  std::vector<std::pair<std::string_view, const Entry*>> with_prefix(std::string_view prefix,
                                                                     std::size_t limit) const;

  // A name that is not in use.
  void add(const std::string& name, const Entry& entry, Undo& undo);
  void remove_of(BodyId body, Undo& undo);

 private:
  void insert(const std::string& name, const Entry& entry);

  absl::btree_map<std::string, Entry, std::less<>> frames_;
  absl::btree_set<std::pair<BodyId, std::string>> by_body_;
};

}  // namespace tessera
