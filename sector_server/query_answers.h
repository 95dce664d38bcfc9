// What a sector server answers to the coordinator's questions, for its partition.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <functional>
#include <utility>

#include "cluster.pb.h"
#include "lpss/observe/queries.h"
#include "lpss/partition/partition.h"
#include "sector_server/changed_chunks.h"
#include "sector_server/tick_meter.h"
#include "transport/link.h"

namespace tessera {

class QueryAnswers {
 public:
  using Send = std::function<void(NodeId, const v1::ClusterMessage&)>;

  // The partition must outlive this.
  QueryAnswers(std::uint64_t world, Partition& partition, Send send)
      : world_(world), partition_(partition), queries_(partition), send_(std::move(send)) {}

  // INVALID_ARGUMENT for a question that answer() must not be given.
  absl::Status check(const v1::Question& question) const;

  // Between ticks, after that one. The state that all servers share comes from the one with rank 0.
  void answer(const v1::Question& question, Tick tick, bool with_shared, const TickMeter& meter);

 private:
  void answer_with_snapshot(const v1::SnapshotQuery& query, v1::ClusterMessage answer, bool with_shared);

  const std::uint64_t world_;
  Partition& partition_;
  Queries queries_;
  const Send send_;
  ChangedChunks changed_chunks_;
};

}  // namespace tessera
