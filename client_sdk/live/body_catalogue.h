// The known bodies of one world: names, properties and shapes, and the poses of the static ones.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <limits>
#include <map>
#include <span>
#include <vector>

#include "tessera/client.h"

namespace tessera::live {

// A body that never moves and is therefore in no stream.
struct StaticBody {
  BodySample sample;
  double radius =
      std::numeric_limits<double>::infinity();  // m, of a sphere around the body frame that contains it
};

class BodyCatalogue {
 public:
  explicit BodyCatalogue(Client& client) : client_(client) {}

  // Clears everything, for another world.
  void clear();

  // Asks the cluster for the unknown ones of `ids`. Bodies that no longer exist stay unknown.
  absl::Status learn(std::span<const BodyId> ids);

  // Asks the cluster for all static bodies.
  absl::Status learn_statics();

  // Null if it is not known.
  const FoundBody* find(BodyId id) const;
  const Shape& shape(ShapeId id) const { return shapes_.at(id); }
  const std::vector<StaticBody>& statics() const { return statics_; }  // ascending by id

 private:
  void add(FoundBodies found);

  Client& client_;
  absl::flat_hash_map<BodyId, FoundBody> bodies_;
  std::map<ShapeId, Shape> shapes_;
  std::vector<StaticBody> statics_;
};

}  // namespace tessera::live
