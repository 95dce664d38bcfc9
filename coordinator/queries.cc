#include "coordinator/queries.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "coordinator/limits.h"

namespace tessera {

absl::Status Queries::room() const {
  if (open_.size() < kOpenQueriesMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(open_.size(), " queries are open already, the most that may"));
}

v1::Query Queries::open(std::variant<Hash, Ray> question) {
  v1::Query query;
  query.set_id(++last_id_);
  open_.emplace(last_id_, Open{std::move(question), std::vector<bool>(servers_), servers_});
  return query;
}

v1::Query Queries::hash(HashReply reply) {
  v1::Query query = open(Hash{std::move(reply), {}});
  query.mutable_hash();
  return query;
}

v1::Query Queries::ray(v1::RayQuery ray, RayReply reply) {
  v1::Query query = open(Ray{std::move(reply), {}});
  *query.mutable_ray() = std::move(ray);
  return query;
}

absl::Status Queries::answer(std::size_t rank, const v1::Answer& answer) {
  const auto found = open_.find(answer.query());
  if (found == open_.end() || found->second.answered[rank]) {
    return absl::InternalError(absl::StrCat("it answers query ", answer.query(), ", which is not open"));
  }
  Open& open = found->second;
  open.answered[rank] = true;
  if (auto* hash = std::get_if<Hash>(&open.question)) {
    hash->sum.add(WorldHash(answer.hash_low(), answer.hash_high()));
  } else if (answer.hit()) {
    RayResult& nearest = std::get<Ray>(open.question).nearest;
    const auto before = [&] {
      if (!nearest.body || answer.distance() != nearest.distance) return answer.distance() < nearest.distance;
      return BodyId{answer.body()} < *nearest.body;
    };
    if (!nearest.body || before()) {
      nearest.body = BodyId{answer.body()};
      nearest.distance = answer.distance();
      nearest.normal = answer.normal();
    }
  }
  if (--open.missing > 0) return absl::OkStatus();

  const std::variant<Hash, Ray> question = std::move(open.question);
  open_.erase(found);
  if (const auto* hash = std::get_if<Hash>(&question)) {
    hash->reply(absl::OkStatus(), answer.tick(), hash->sum);
  } else {
    Ray ray = std::get<Ray>(question);
    ray.nearest.tick = answer.tick();
    ray.reply(absl::OkStatus(), ray.nearest);
  }
  return absl::OkStatus();
}

void Queries::abandon(const absl::Status& status) {
  for (const auto& [id, open] : std::exchange(open_, {})) {
    if (const auto* hash = std::get_if<Hash>(&open.question)) {
      hash->reply(status, 0, {});
    } else {
      std::get<Ray>(open.question).reply(status, {});
    }
  }
}

}  // namespace tessera
