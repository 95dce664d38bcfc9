// Lists of clients' queries: what servers are asked, and the results of what they know.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/query_kinds.h"
#include "coordinator/world_registry.h"
#include "query.pb.h"

namespace tessera {

class AskedQueries {
 public:
  // What the registry knows is answered as of now, with all commands so far. Errors name the element, as
  // those of checked().
  // Stops, with RESOURCE_EXHAUSTED, once one query has been looked at and `takes_too_long`, if there is any,
  // says so.
  static absl::StatusOr<AskedQueries> checked(const google::protobuf::RepeatedPtrField<v1::Query>& queries,
                                              const WorldRegistry& world,
                                              const std::function<bool()>& takes_too_long = {});

  // Bounds for each server. See v1::Queries; 0: none.
  void bound(std::chrono::microseconds work_max, std::size_t bytes_max);

  // What servers are asked; none may be.
  const v1::Queries& asked() const { return asked_; }

  // What one of them knows. INTERNAL if it is no answer.
  absl::Status add(v1::Answer answer);
  void forget_answers();
  // Of the server that took longest, so far.
  std::chrono::microseconds work() const { return work_; }

  // By query, with what all servers have added; once. DATA_LOSS for an answer that is malformed,
  // RESOURCE_EXHAUSTED where a bound was too low for a server.
  absl::StatusOr<google::protobuf::RepeatedPtrField<v1::QueryResult>> results(const WorldRegistry& world);

 private:
  struct Item {
    int place = 0;          // in the list
    AskedQuery query;       // its questions are in asked_
    std::size_t first = 0;  // of them, there
    std::vector<Parts> parts;
  };

  absl::Status take(int place, const v1::Query& query, const WorldRegistry& world);

  google::protobuf::RepeatedPtrField<v1::QueryResult> results_;  // of the registry; others are empty
  std::vector<Item> items_;
  v1::Queries asked_;
  std::chrono::microseconds work_{};
  v1::Answer::Excess excess_ = v1::Answer::NONE;
};

}  // namespace tessera
