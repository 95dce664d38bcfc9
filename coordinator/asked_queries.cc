#include "coordinator/asked_queries.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/element_name.h"
#include "coordinator/limits.h"
#include "coordinator/query_checks.h"
#include "lpss/model/checks.h"
#include "lpss/observe/world_hash.h"

namespace tessera {
namespace {

using Results = google::protobuf::RepeatedPtrField<v1::QueryResult>;

v1::HashResult hash_of(const Parts& parts) {
  WorldHash sum;
  WorldHash programs;
  for (const v1::PartialResult& part : parts) {
    sum.add(WorldHash(part.hash_low(), part.hash_high()));
    programs.add(WorldHash(part.programs_low(), part.programs_high()));
  }
  v1::HashResult result;
  result.set_hash(sum.to_string());
  if (programs != WorldHash()) result.set_programs(programs.to_string());
  return result;
}

absl::Status too_long_error() {
  return absl::ResourceExhaustedError(absl::StrCat(
      "queries of role observe may take ", kObserveStretchMax.count(),
      " ms between two ticks, and these would take longer: ask for less at once, or again later"));
}

std::size_t found_in(const v1::QueryResult& result) {
  return static_cast<std::size_t>(result.find_bodies().bodies_size() + result.find_joints().joints_size() +
                                  result.find_frames().frames_size());
}

// Whether the registry knows all of the answer.
bool answer(const v1::Query& query, const WorldRegistry& world, v1::QueryResult& result) {
  switch (query.kind_case()) {
    case v1::Query::kFindBodies:
      *result.mutable_find_bodies() = world.find(query.find_bodies());
      return true;
    case v1::Query::kFindJoints:
      *result.mutable_find_joints() = world.find(query.find_joints());
      return true;
    case v1::Query::kFindFrames:
      *result.mutable_find_frames() = world.find(query.find_frames());
      return true;
    default:
      return false;
  }
}

}  // namespace

absl::StatusOr<AskedQuery> ask(const v1::HashQuery& query, const WorldRegistry&) {
  AskedQuery ask;
  *ask.asked.emplace_back().mutable_hash() = query;
  ask.finish = [](std::span<Parts> parts, const WorldRegistry&, v1::QueryResult& result) {
    *result.mutable_hash() = hash_of(parts[0]);
    return absl::OkStatus();
  };
  return ask;
}

absl::StatusOr<AskedQueries> AskedQueries::checked(
    const google::protobuf::RepeatedPtrField<v1::Query>& queries, const WorldRegistry& world,
    const std::function<bool()>& takes_too_long) {
  if (queries.size() > kQueriesPerListMax)
    return refused("queries: ", queries.size(), " elements must be at most ", kQueriesPerListMax);
  if (absl::Status status = check_work(queries, world.settings().sector_size); !status.ok()) return status;
  AskedQueries list;
  std::size_t found = 0;
  for (int place = 0; place < queries.size(); ++place) {
    if (place > 0 && takes_too_long && takes_too_long()) return too_long_error();
    list.results_.Add();
    if (absl::Status status = list.take(place, queries[place], world); !status.ok())
      return at_element(status, "queries", place, queries[place], queries.size());
    found += found_in(list.results_[place]);
    if (place > 0 && found > kFoundBodiesMax) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "queries: what they find is more than ", kFoundBodiesMax,
          " bodies, joints and frames, which is all that one request may: ask for less at once"));
    }
  }
  return list;
}

void AskedQueries::bound(std::chrono::microseconds work_max, std::size_t bytes_max) {
  asked_.set_work_us_max(static_cast<std::uint64_t>(work_max.count()));
  asked_.set_bytes_max(bytes_max);
}

absl::Status AskedQueries::take(int place, const v1::Query& query, const WorldRegistry& world) {
  if (answer(query, world, results_[place])) return absl::OkStatus();
  absl::StatusOr<AskedQuery> asked = ask(query, world);
  if (!asked.ok()) return asked.status();
  Item& item = items_.emplace_back();
  item.place = place;
  item.first = static_cast<std::size_t>(asked_.all_size());
  item.parts.resize(asked->asked.size());
  for (v1::Query& question : asked->asked) *asked_.add_all() = std::move(question);
  asked->asked.clear();
  item.query = *std::move(asked);
  return absl::OkStatus();
}

absl::Status AskedQueries::add(v1::Answer answer) {
  work_ = std::max(work_, std::chrono::microseconds(answer.work_us()));
  if (answer.excess() != v1::Answer::NONE) {
    excess_ = answer.excess();
    return absl::OkStatus();
  }
  if (answer.results_size() != asked_.all_size()) {
    return absl::InternalError(
        absl::StrCat("it answers ", answer.results_size(), " queries of ", asked_.all_size()));
  }
  for (Item& item : items_) {
    for (std::size_t n = 0; n < item.parts.size(); ++n)
      item.parts[n].push_back(std::move(*answer.mutable_results(static_cast<int>(item.first + n))));
  }
  return absl::OkStatus();
}

void AskedQueries::forget_answers() {
  excess_ = v1::Answer::NONE;
  for (Item& item : items_) {
    for (Parts& parts : item.parts) parts.clear();
  }
}

absl::StatusOr<Results> AskedQueries::results(const WorldRegistry& world) {
  if (excess_ == v1::Answer::BYTES) {
    return absl::ResourceExhaustedError(absl::StrCat("queries: a server's results take more than ",
                                                     asked_.bytes_max(), " bytes of the ", kResultBytesMax,
                                                     " that one request may have: ask for less at once"));
  }
  if (excess_ != v1::Answer::NONE) return too_long_error();
  for (Item& item : items_) {
    if (absl::Status status = item.query.finish(item.parts, world, results_[item.place]); !status.ok())
      return status;
  }
  return std::move(results_);
}

}  // namespace tessera
