// What a sector server answers to the coordinator's questions, for its partition.
#pragma once

#include <absl/status/status.h>

#include <chrono>
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
  using Nanoseconds = std::chrono::nanoseconds;
  using Clock = std::function<Nanoseconds()>;

  // The partition must outlive this.
  QueryAnswers(std::uint64_t world, Partition& partition, Send send)
      : world_(world), partition_(partition), queries_(partition), send_(std::move(send)) {}

  // INVALID_ARGUMENT for a question that answer() must not be given.
  absl::Status check(const v1::Question& question) const;

  // Between ticks, after that one. The state that all servers share comes from the one with rank 0. `clock`
  // measures work, and what takes too long (v1::Queries) is not answered.
  void answer(const v1::Question& question, Tick tick, bool with_shared, const TickMeter& meter,
              const Clock& clock);
  void after_tick() { bounded_work_ = {}; }

 private:
  void answer_queries(const v1::Queries& queries, const Clock& clock, v1::Answer& answer);
  void answer_with_snapshot(const v1::SnapshotQuery& query, v1::ClusterMessage answer, bool with_shared);

  const std::uint64_t world_;
  Partition& partition_;
  Queries queries_;
  const Send send_;
  ChangedChunks changed_chunks_;
  Nanoseconds bounded_work_{};  // since the last tick, on queries whose work is bounded
};

}  // namespace tessera
