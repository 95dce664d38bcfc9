// Lists of clients' queries: what servers are asked, and the results of what they know.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <optional>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/world_registry.h"
#include "lpss/model/joint.h"
#include "query.pb.h"

namespace tessera {

class AskedQueries {
 public:
  // What the registry knows is answered as of now, with all commands so far. Errors name the element, as
  // those of checked().
  static absl::StatusOr<AskedQueries> checked(const google::protobuf::RepeatedPtrField<v1::Query>& queries,
                                              const WorldRegistry& world);

  // What servers are asked; none may be.
  const v1::Queries& asked() const { return asked_; }

  // What one of them knows. INTERNAL if it is no answer.
  absl::Status add(v1::Answer answer);
  void forget_answers();

  // By query, with what all servers have added; once. DATA_LOSS for an answer that is malformed.
  absl::StatusOr<google::protobuf::RepeatedPtrField<v1::QueryResult>> results(const WorldRegistry& world);

 private:
  // A query that servers answer.
  struct Item {
    int place = 0;                                   // in the list
    std::optional<std::vector<JointRecord>> joints;  // of joint states
    std::vector<v1::PartialResult> parts;
  };

  absl::Status take(int place, const v1::Query& query, const WorldRegistry& world);
  template <typename Checked>
  absl::Status ask(int place, absl::StatusOr<Checked> query, Checked* (v1::Query::*field)());
  void ask_states(int place, const v1::StatesQuery& query, const WorldRegistry& world);
  void ask_joint_states(int place, const v1::JointStatesQuery& query, const WorldRegistry& world);
  Item& ask(int place, v1::Query query);
  absl::Status finish(Item& item, const v1::Query& query, const WorldRegistry& world,
                      v1::QueryResult& result) const;

  google::protobuf::RepeatedPtrField<v1::QueryResult> results_;  // of the registry; others are empty
  std::vector<Item> items_;
  v1::Queries asked_;  // of each item
};

}  // namespace tessera
