// The kinds of queries: what servers are asked for one, and what their answers come to.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <span>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/world_registry.h"
#include "lpss/model/checks.h"
#include "query.pb.h"

namespace tessera {

// What servers have answered to one question, in any order.
using Parts = std::vector<v1::PartialResult>;

// A query for the servers.
struct AskedQuery {
  std::vector<v1::Query> asked;
  // With the parts of each question. DATA_LOSS for an answer that is malformed, others as the query's kind
  // has them.
  std::function<absl::Status(std::span<Parts> parts, const WorldRegistry& world, v1::QueryResult& result)>
      finish;
};

// Each checks a query as it comes from a client: INVALID_ARGUMENT with the field and the bound, NOT_FOUND for
// a body or joint that must be there, OUT_OF_RANGE for places outside the 64-bit range of sectors.
absl::StatusOr<AskedQuery> ask(const v1::RayQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::RaysQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::SweepQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::NearQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::StatesQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::ProgramsQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::JointStatesQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::HashQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::ContactsQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::DistanceQuery& query, const WorldRegistry& world);
absl::StatusOr<AskedQuery> ask(const v1::DynamicsQuery& query, const WorldRegistry& world);

// Of any of these kinds; INVALID_ARGUMENT for others.
inline absl::StatusOr<AskedQuery> ask(const v1::Query& query, const WorldRegistry& world) {
  switch (query.kind_case()) {
    case v1::Query::kRay:
      return ask(query.ray(), world);
    case v1::Query::kRays:
      return ask(query.rays(), world);
    case v1::Query::kSweep:
      return ask(query.sweep(), world);
    case v1::Query::kNear:
      return ask(query.near(), world);
    case v1::Query::kStates:
      return ask(query.states(), world);
    case v1::Query::kJointStates:
      return ask(query.joint_states(), world);
    case v1::Query::kHash:
      return ask(query.hash(), world);
    case v1::Query::kPrograms:
      return ask(query.programs(), world);
    case v1::Query::kContacts:
      return ask(query.contacts(), world);
    case v1::Query::kDistance:
      return ask(query.distance(), world);
    case v1::Query::kDynamics:
      return ask(query.dynamics(), world);
    default:
      return refused("a query of no known kind");
  }
}

}  // namespace tessera
