#include "coordinator/queries.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"

namespace tessera {

absl::Status Queries::room() const {
  if (open_.size() < kOpenQueriesMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(open_.size(), " queries are open already, which is the maximum"));
}

v1::Query Queries::open(Question question, v1::Query query) {
  query.set_id(++last_id_);
  open_.emplace(last_id_, Open{std::move(question), query, {}, {}, 0});
  return query;
}

v1::Query Queries::hash(HashReply reply) {
  v1::Query query;
  query.mutable_hash();
  return open(Hash{std::move(reply), {}}, std::move(query));
}

v1::Query Queries::ray(v1::RayQuery ray, RayReply reply) {
  v1::Query query;
  *query.mutable_ray() = std::move(ray);
  return open(Ray{std::move(reply), {}}, std::move(query));
}

v1::Query Queries::near(v1::NearQuery near, NearReply reply) {
  v1::Query query;
  *query.mutable_near() = std::move(near);
  return open(Near{std::move(reply), {}}, std::move(query));
}

v1::Query Queries::snapshot(const v1::SnapshotQuery& snapshot, SnapshotReply reply) {
  v1::Query query;
  *query.mutable_snapshot() = snapshot;
  return open(Snapshot{std::move(reply), {}, {}}, std::move(query));
}

v1::Query Queries::load(double ahead, LoadReply reply) {
  v1::Query query;
  query.mutable_load()->set_ahead(ahead);
  return open(Load{std::move(reply), {}}, std::move(query));
}

void Queries::asked(std::uint64_t query, std::span<const NodeId> nodes) {
  const auto found = open_.find(query);
  if (found == open_.end()) return;
  Open& open = found->second;
  invariant(open.nodes.empty() && !nodes.empty(), "a question is asked once, of somebody");
  open.nodes.assign(nodes.begin(), nodes.end());
  open.answered.assign(nodes.size(), false);
  open.missing = nodes.size();
  if (auto* snapshot = std::get_if<Snapshot>(&open.question)) {
    snapshot->chunks.resize(nodes.size());
    snapshot->parts.resize(nodes.size());
  }
  if (auto* load = std::get_if<Load>(&open.question)) load->loads.resize(nodes.size());
}

std::vector<v1::Query> Queries::restart(const absl::Status& status) {
  std::vector<v1::Query> again;
  for (auto& [id, open] : std::exchange(open_, {})) {
    if (std::holds_alternative<Snapshot>(open.question) || std::holds_alternative<Load>(open.question)) {
      reply(status, 0, open.question);
      continue;
    }
    if (auto* hash = std::get_if<Hash>(&open.question)) hash->sum = {};
    if (auto* ray = std::get_if<Ray>(&open.question)) ray->nearest = {};
    if (auto* near = std::get_if<Near>(&open.question)) near->result = {};
    // One that has not been asked waits for its turn, and will be.
    if (!open.nodes.empty()) again.push_back(open.query);
    open.nodes.clear();
    open_.emplace(id, std::move(open));
  }
  return again;
}

absl::Status Queries::answer(NodeId from, v1::Answer answer) {
  absl::Status not_open =
      absl::InternalError(absl::StrCat("it answers query ", answer.query(), ", which is not open"));
  const auto found = open_.find(answer.query());
  if (found == open_.end()) return not_open;
  Open& open = found->second;
  const auto place = std::find(open.nodes.begin(), open.nodes.end(), from);
  const auto rank = static_cast<std::size_t>(place - open.nodes.begin());
  if (place == open.nodes.end() || open.answered[rank]) return not_open;
  if (auto* snapshot = std::get_if<Snapshot>(&open.question)) {
    add(*snapshot, rank, answer);
    if (++snapshot->parts[rank] < answer.parts()) return absl::OkStatus();
  } else if (auto* hash = std::get_if<Hash>(&open.question)) {
    add(*hash, answer);
  } else if (auto* ray = std::get_if<Ray>(&open.question)) {
    add(*ray, answer);
  } else if (auto* load = std::get_if<Load>(&open.question)) {
    load->loads[rank] = answer.load();
  } else {
    add(std::get<Near>(open.question), answer);
  }
  invariant(open.missing > 0, "a question is open while an answer is missing");
  open.answered[rank] = true;
  if (--open.missing > 0) return absl::OkStatus();
  Question question = std::move(open.question);
  open_.erase(found);
  reply(absl::OkStatus(), answer.tick(), question);
  return absl::OkStatus();
}

void Queries::add(Hash& hash, const v1::Answer& answer) {
  hash.sum.add(WorldHash(answer.hash_low(), answer.hash_high()));
}

void Queries::add(Ray& ray, const v1::Answer& answer) {
  if (!answer.hit()) return;
  RayResult& nearest = ray.nearest;
  const auto before = [&] {
    if (answer.distance() != nearest.distance) return answer.distance() < nearest.distance;
    return BodyId{answer.body()} < *nearest.body;
  };
  if (nearest.body && !before()) return;
  nearest.body = BodyId{answer.body()};
  nearest.distance = answer.distance();
  nearest.normal = answer.normal();
}

// Several servers may report the same static body.
void Queries::add(Near& near, const v1::Answer& answer) {
  for (const v1::NearBody& body : answer.near()) {
    const auto [place, is_new] = near.result.distances.try_emplace(BodyId{body.body()}, body.distance());
    if (!is_new) place->second = std::min(place->second, body.distance());
  }
}

void Queries::add(Snapshot& snapshot, std::size_t rank, v1::Answer& answer) {
  std::move(answer.mutable_snapshot()->begin(), answer.mutable_snapshot()->end(),
            std::back_inserter(snapshot.chunks[rank]));
}

void Queries::reply(const absl::Status& status, Tick tick, Question& question) {
  if (const auto* hash = std::get_if<Hash>(&question)) {
    hash->reply(status, tick, hash->sum);
  } else if (auto* ray = std::get_if<Ray>(&question)) {
    ray->nearest.tick = tick;
    ray->reply(status, ray->nearest);
  } else if (auto* near = std::get_if<Near>(&question)) {
    near->result.tick = tick;
    near->reply(status, near->result);
  } else if (auto* load = std::get_if<Load>(&question)) {
    load->reply(status, tick, std::move(load->loads));
  } else {
    auto& snapshot = std::get<Snapshot>(question);
    std::vector<v1::SnapshotChunk> all;
    for (std::vector<v1::SnapshotChunk>& chunks : snapshot.chunks) {
      std::move(chunks.begin(), chunks.end(), std::back_inserter(all));
    }
    // Answers may overtake each other, and what all sectors share comes before them.
    std::stable_partition(all.begin(), all.end(), [](const auto& chunk) { return chunk.has_shared(); });
    snapshot.reply(status, std::move(all));
  }
}

void Queries::abandon(const absl::Status& status) {
  for (auto& [id, open] : std::exchange(open_, {})) {
    Question question = std::move(open.question);
    reply(status, 0, question);
  }
}

}  // namespace tessera
