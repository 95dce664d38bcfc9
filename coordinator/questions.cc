#include "coordinator/questions.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"

namespace tessera {

absl::Status Questions::room() const {
  if (open_.size() < kOpenQuestionsMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(open_.size(), " questions are open already, which is the maximum"));
}

v1::Question Questions::open(Kind kind, v1::Question question) {
  question.set_id(++last_id_);
  open_.emplace(last_id_, Open{std::move(kind), {}, {}, 0});
  return question;
}

v1::Question Questions::queries(AskedQueries list, QueriesReply reply) {
  v1::Question question;
  *question.mutable_queries() = list.asked();
  return open(Queries{std::move(reply), std::move(list)}, std::move(question));
}

v1::Question Questions::question_of(std::uint64_t id, const Queries& queries) {
  v1::Question question;
  question.set_id(id);
  *question.mutable_queries() = queries.list.asked();
  return question;
}

v1::Question Questions::snapshot(const v1::SnapshotQuery& snapshot, SnapshotReply reply) {
  v1::Question question;
  *question.mutable_snapshot() = snapshot;
  return open(Snapshot{std::move(reply), {}, {}}, std::move(question));
}

v1::Question Questions::load(double ahead, LoadReply reply) {
  v1::Question question;
  question.mutable_load()->set_ahead(ahead);
  return open(Load{std::move(reply), {}}, std::move(question));
}

void Questions::asked(std::uint64_t question, std::span<const NodeId> nodes) {
  const auto found = open_.find(question);
  if (found == open_.end()) return;
  Open& open = found->second;
  invariant(open.nodes.empty() && !nodes.empty(), "a question is asked once, of somebody");
  open.nodes.assign(nodes.begin(), nodes.end());
  open.answered.assign(nodes.size(), false);
  open.missing = nodes.size();
  if (auto* snapshot = std::get_if<Snapshot>(&open.kind)) {
    snapshot->chunks.resize(nodes.size());
    snapshot->parts.resize(nodes.size());
  }
  if (auto* load = std::get_if<Load>(&open.kind)) load->loads.resize(nodes.size());
}

std::vector<v1::Question> Questions::restart(const absl::Status& status) {
  std::vector<v1::Question> again;
  for (auto& [id, open] : std::exchange(open_, {})) {
    auto* queries = std::get_if<Queries>(&open.kind);
    if (queries == nullptr) {
      reply(status, 0, open.kind);
      continue;
    }
    queries->list.forget_answers();
    // One that has not been asked waits for its turn, and will be.
    if (!open.nodes.empty()) again.push_back(question_of(id, *queries));
    open.nodes.clear();
    open_.emplace(id, std::move(open));
  }
  return again;
}

absl::Status Questions::answer(NodeId from, v1::Answer answer) {
  absl::Status not_open =
      absl::InternalError(absl::StrCat("it answers question ", answer.question(), ", which is not open"));
  const auto found = open_.find(answer.question());
  if (found == open_.end()) return not_open;
  Open& open = found->second;
  const Tick tick = answer.tick();
  const auto place = std::find(open.nodes.begin(), open.nodes.end(), from);
  const auto rank = static_cast<std::size_t>(place - open.nodes.begin());
  if (place == open.nodes.end() || open.answered[rank]) return not_open;
  if (auto* snapshot = std::get_if<Snapshot>(&open.kind)) {
    add(*snapshot, rank, answer);
    if (++snapshot->parts[rank] < answer.parts()) return absl::OkStatus();
  } else if (auto* load = std::get_if<Load>(&open.kind)) {
    load->loads[rank] = answer.load();
  } else if (absl::Status status = std::get<Queries>(open.kind).list.add(std::move(answer)); !status.ok()) {
    return status;
  }
  invariant(open.missing > 0, "a question is open while an answer is missing");
  open.answered[rank] = true;
  if (--open.missing > 0) return absl::OkStatus();
  Kind kind = std::move(open.kind);
  open_.erase(found);
  reply(absl::OkStatus(), tick, kind);
  return absl::OkStatus();
}

void Questions::add(Snapshot& snapshot, std::size_t rank, v1::Answer& answer) {
  std::move(answer.mutable_snapshot()->begin(), answer.mutable_snapshot()->end(),
            std::back_inserter(snapshot.chunks[rank]));
}

void Questions::reply(const absl::Status& status, Tick tick, Kind& kind) {
  if (auto* queries = std::get_if<Queries>(&kind)) {
    queries->reply(status, tick, queries->list);
  } else if (auto* load = std::get_if<Load>(&kind)) {
    load->reply(status, tick, std::move(load->loads));
  } else {
    auto& snapshot = std::get<Snapshot>(kind);
    std::vector<v1::SnapshotChunk> all;
    for (std::vector<v1::SnapshotChunk>& chunks : snapshot.chunks) {
      std::move(chunks.begin(), chunks.end(), std::back_inserter(all));
    }
    // Answers may overtake each other, and what all sectors share comes before them.
    std::stable_partition(all.begin(), all.end(), [](const auto& chunk) { return chunk.has_shared(); });
    snapshot.reply(status, std::move(all));
  }
}

void Questions::abandon(const absl::Status& status) {
  for (auto& [id, open] : std::exchange(open_, {})) {
    Kind kind = std::move(open.kind);
    reply(status, 0, kind);
  }
}

}  // namespace tessera
