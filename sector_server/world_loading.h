// What a sector server is sent of a world, checked before anything is made of it.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "cluster.pb.h"
#include "lpss/engine/engine.h"
#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// INVALID_ARGUMENT for settings that cannot be.
absl::StatusOr<WorldSettings> settings_of(const v1::LoadWorld& load);

// The partition of the server with rank `self` among `servers`; those above are guests. The engine must
// outlive it. Takes the shapes out of the message. INVALID_ARGUMENT for what cannot be.
absl::StatusOr<std::unique_ptr<Partition>> loaded_partition(v1::LoadWorld& load,
                                                            const WorldSettings& settings, Engine& engine,
                                                            std::size_t servers, Rank self);

// The map that a grant carries, of so many servers.
absl::StatusOr<SectorMap> map_of(const Partition& partition, const v1::SectorMap& message,
                                 std::size_t servers);

// Takes them out of their messages, each of which gives its memory back before the next one needs some.
// INVALID_ARGUMENT for shapes that cannot be, or are there already; NOT_FOUND, and the like, for ground that
// this server does not have.
absl::Status add_shapes(Partition& partition, google::protobuf::RepeatedPtrField<v1::NumberedShape>& shapes);

// Likewise of modules, but for those that are there already. NOT_FOUND where this server has no engine for
// them.
absl::Status add_modules(Partition& partition, google::protobuf::RepeatedPtrField<std::string>& modules);

}  // namespace tessera
