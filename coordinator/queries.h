// Questions that every server of a world answers for its partition, and the combined answers.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/status/status.h>

#include <functional>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "cluster.pb.h"
#include "lpss/observe/world_hash.h"
#include "lpss/tick/messages.h"
#include "transport/link.h"

namespace tessera {

class Queries {
 public:
  struct RayResult {
    Tick tick = 0;
    std::optional<BodyId> body;  // nothing was hit
    double distance = 0;
    v1::Vector3 normal;
  };
  struct NearResult {
    Tick tick = 0;
    absl::btree_map<BodyId, double> distances;  // m
  };
  using HashReply = std::function<void(const absl::Status&, Tick, const WorldHash&)>;
  using RayReply = std::function<void(const absl::Status&, const RayResult&)>;
  using NearReply = std::function<void(const absl::Status&, const NearResult&)>;
  // The chunks of all servers, by rank; the state that all share comes first.
  using SnapshotReply = std::function<void(const absl::Status&, std::vector<v1::SnapshotChunk>)>;

  // By rank.
  using LoadReply = std::function<void(const absl::Status&, Tick, std::vector<v1::ServerLoad>)>;

  // Each returns the question to send to all servers; `reply` is called with the last answer.
  // RESOURCE_EXHAUSTED, without calling `reply`, while kOpenQueriesMax queries are open.
  absl::Status room() const;
  v1::Query hash(HashReply reply);
  v1::Query ray(v1::RayQuery ray, RayReply reply);
  v1::Query near(v1::NearQuery near, NearReply reply);
  v1::Query snapshot(const v1::SnapshotQuery& snapshot, SnapshotReply reply);
  v1::Query load(double ahead, LoadReply reply);

  // The question has been sent to these servers, by rank.
  void asked(std::uint64_t query, std::span<const NodeId> nodes);

  // INTERNAL for an answer to a question that this server was not asked, or that it has answered before.
  absl::Status answer(NodeId from, v1::Answer answer);

  // The world goes on, set back, on other servers: all questions that were asked are to be asked again. Those
  // for snapshots and loads are refused with `status`: their tick may be over, and the servers are others.
  std::vector<v1::Query> restart(const absl::Status& status);

  // Answers all waiting calls.
  void abandon(const absl::Status& status);

 private:
  struct Hash {
    HashReply reply;
    WorldHash sum;
  };
  struct Ray {
    RayReply reply;
    RayResult nearest;
  };
  struct Near {
    NearReply reply;
    NearResult result;
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
  using Question = std::variant<Hash, Ray, Near, Snapshot, Load>;
  struct Open {
    Question question;
    v1::Query query;            // as asked
    std::vector<NodeId> nodes;  // by rank; none before it was asked
    std::vector<bool> answered;
    std::size_t missing = 0;
  };

  v1::Query open(Question question, v1::Query query);
  static void add(Hash& hash, const v1::Answer& answer);
  static void add(Ray& ray, const v1::Answer& answer);
  static void add(Near& near, const v1::Answer& answer);
  static void add(Snapshot& snapshot, std::size_t rank, v1::Answer& answer);
  static void reply(const absl::Status& status, Tick tick, Question& question);

  std::uint64_t last_id_ = 0;
  absl::btree_map<std::uint64_t, Open> open_;
};

}  // namespace tessera
