// Questions that every server of a world answers for its partition, and the combined answers.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/status/status.h>

#include <functional>
#include <span>
#include <variant>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/asked_queries.h"
#include "lpss/tick/messages.h"
#include "transport/link.h"

namespace tessera {

class Questions {
 public:
  // With what the servers know of it.
  using QueriesReply = std::function<void(const absl::Status&, Tick, AskedQueries&)>;
  // The chunks of all servers, by rank; the state that all share comes first.
  using SnapshotReply = std::function<void(const absl::Status&, std::vector<v1::SnapshotChunk>)>;
  // By rank.
  using LoadReply = std::function<void(const absl::Status&, Tick, std::vector<v1::ServerLoad>)>;

  // Each returns the question to send to all servers; `reply` is called with the last answer.
  // RESOURCE_EXHAUSTED, without calling `reply`, while kOpenQuestionsMax are open.
  absl::Status room() const;
  v1::Question queries(AskedQueries list, QueriesReply reply);
  v1::Question snapshot(const v1::SnapshotQuery& snapshot, SnapshotReply reply);
  v1::Question load(double ahead, LoadReply reply);

  // The question has been sent to these servers, by rank.
  void asked(std::uint64_t question, std::span<const NodeId> nodes);

  // INTERNAL for an answer to a question that this server was not asked, that it has answered before, or that
  // is no answer to it.
  absl::Status answer(NodeId from, v1::Answer answer);

  // The world goes on, set back, on other servers: all questions that were asked are to be asked again. Those
  // for snapshots and loads are refused with `status`: their tick may be over, and the servers are others.
  std::vector<v1::Question> restart(const absl::Status& status);

  // Answers all waiting calls.
  void abandon(const absl::Status& status);

 private:
  struct Queries {
    QueriesReply reply;
    AskedQueries list;
  };
  struct Snapshot {
    SnapshotReply reply;
    std::vector<std::vector<v1::SnapshotChunk>> chunks;  // by rank
    std::vector<std::uint32_t> parts;                    // that have come, by rank
  };
  struct Load {
    LoadReply reply;
    std::vector<v1::ServerLoad> loads;  // by rank
  };
  using Kind = std::variant<Queries, Snapshot, Load>;
  struct Open {
    Kind kind;
    std::vector<NodeId> nodes;  // by rank; none before it was asked
    std::vector<bool> answered;
    std::size_t missing = 0;
  };

  v1::Question open(Kind kind, v1::Question question);
  static v1::Question question_of(std::uint64_t id, const Queries& queries);
  static void add(Snapshot& snapshot, std::size_t rank, v1::Answer& answer);
  static void reply(const absl::Status& status, Tick tick, Kind& kind);

  std::uint64_t last_id_ = 0;
  absl::btree_map<std::uint64_t, Open> open_;
};

}  // namespace tessera
