// Checks clients' queries against the world and brings them to one form.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include "coordinator/world_registry.h"
#include "query.pb.h"

namespace tessera {

// Whether a list takes no more work than one client may ask for at once: bounds of all its queries together.
absl::Status check_work(const google::protobuf::RepeatedPtrField<v1::Query>& queries, double sector_size);

// Places are canonical, directions have unit length, masks are not 0, a point is a tiny ball, and bodies to
// pass through are given by their ids, ascending; those that do not exist are left out. INVALID_ARGUMENT with
// the field and the bound; OUT_OF_RANGE for places outside the 64-bit range of sectors.
absl::StatusOr<v1::RayQuery> checked(const v1::RayQuery& query, const WorldRegistry& world);
// Each array has an element for each ray, as RayWriter writes them.
absl::StatusOr<v1::RaysQuery> checked(const v1::RaysQuery& query, const WorldRegistry& world);
absl::StatusOr<v1::SweepQuery> checked(const v1::SweepQuery& query, const WorldRegistry& world);
absl::StatusOr<v1::NearQuery> checked(const v1::NearQuery& query, const WorldRegistry& world);

}  // namespace tessera
