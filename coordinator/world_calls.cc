#include "coordinator/world_calls.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "coordinator/sequence_list.h"
#include "proto/convert.h"
#include "proto/snapshot.h"

namespace tessera {
namespace {

// Adapts a reply with nothing but a tick to the sequencer's kind of reply.
template <typename Answer>
Sequencer::Reply with_tick(std::function<void(absl::Status, const Answer&)> reply) {
  return [reply = std::move(reply)](const absl::Status& status, Tick tick) {
    Answer answer;
    if (status.ok()) answer.set_tick(tick);
    reply(status, answer);
  };
}

// A reply that is given once all that it waits for has come.
class PendingReply : public std::enable_shared_from_this<PendingReply> {
 public:
  // Of queries that were answered, how long the coordinator took for their results, and whether it has any.
  using Account = std::function<void(const AskedQueries&, Nanoseconds, const absl::Status&)>;

  // The world answers all that it was asked before it ends.
  PendingReply(std::function<void(const absl::Status&, const v1::Reply&)> send, const ActiveWorld& world,
               const CoordinatorContext& context, Account account)
      : send_(std::move(send)), world_(world), context_(context), account_(std::move(account)) {}

  v1::Reply& reply() { return reply_; }

  Sequencer::Reply wait_for_ticks() {
    ++missing_;
    return [self = shared_from_this()](const absl::Status& status, Tick tick) {
      if (status.ok()) self->reply_.set_tick(tick);
      self->done(status);
    };
  }
  Questions::QueriesReply wait_for_results() {
    ++missing_;
    return [self = shared_from_this()](const absl::Status& status, Tick tick, AskedQueries& queries) {
      if (!status.ok()) return self->done(status);
      self->reply_.set_tick(tick);
      const Nanoseconds began = self->context_.work_clock();
      self->take(queries);
      self->account_(queries, self->context_.work_clock() - began, self->status_);
      self->done();
    };
  }
  void take(AskedQueries& queries) {
    absl::StatusOr<google::protobuf::RepeatedPtrField<v1::QueryResult>> results =
        queries.results(world_.registry);
    if (results.ok()) {
      *reply_.mutable_results() = *std::move(results);
    } else {
      status_.Update(results.status());
    }
  }
  // One thing less to wait for.
  void done(const absl::Status& status = absl::OkStatus()) {
    status_.Update(status);
    if (--missing_ == 0) send_(status_, reply_);
  }

 private:
  const std::function<void(const absl::Status&, const v1::Reply&)> send_;
  const ActiveWorld& world_;
  const CoordinatorContext& context_;
  const Account account_;
  v1::Reply reply_;
  absl::Status status_;
  int missing_ = 1;  // until all is under way
};

}  // namespace

// Of the sequencer, and of the journal.
absl::Status WorldCalls::room_for(const GivenCommands& given) const {
  if (absl::Status status = context_.journal.room(); !status.ok()) return status;
  std::size_t shape_bytes = 0;
  for (const v1::NumberedShape& shape : given.new_shapes) shape_bytes += shape.ByteSizeLong();
  return world_.sequencer.room_for_commands(given.commands.size(), shape_bytes);
}

// Those of role observe are bounded in time while the world ticks; whoever waits for a step is not.
absl::StatusOr<AskedQueries> WorldCalls::checked_queries(const Call<v1::Request, v1::Reply>& call) const {
  const bool is_bounded = call.role == ClientRole::kObserve && world_.sequencer.ticks();
  const Nanoseconds until = context_.work_clock() + kObserveStretchMax;
  const auto takes_too_long = [&] { return is_bounded && context_.work_clock() > until; };
  absl::StatusOr<AskedQueries> queries =
      AskedQueries::checked(call.request.queries(), world_.registry, takes_too_long);
  if (absl::IsResourceExhausted(queries.status()) && call.role) context_.role_work.add_refusal(*call.role);
  if (!queries.ok()) return queries.status();
  queries->bound(is_bounded ? kObserveStretchMax : std::chrono::milliseconds::zero(),
                 kResultBytesMax / std::max<std::size_t>(world_.servers.nodes().size(), 1));
  return queries;
}

std::function<void(const AskedQueries&, Nanoseconds, const absl::Status&)> WorldCalls::account_of(
    const std::optional<ClientRole>& role) const {
  if (!role) return [](const AskedQueries&, Nanoseconds, const absl::Status&) {};
  return [&work = context_.role_work, role = *role, world_ticks = world_.sequencer.ticks()](
             const AskedQueries& queries, Nanoseconds own, const absl::Status& status) {
    work.add_work(role, queries.work() + own, world_ticks);
    if (absl::IsResourceExhausted(status)) work.add_refusal(role);
  };
}

absl::StatusOr<WorldCalls::Plan> WorldCalls::plan(const Call<v1::Request, v1::Reply>& call,
                                                  bool is_new) const {
  const v1::Request& request = call.request;
  const Tick at = world_.sequencer.next_command_tick();
  Plan plan;
  if (is_new) {
    if (request.ticks() > 0) {
      if (absl::Status status = world_.sequencer.may_step(request.ticks()); !status.ok()) return status;
    }
    plan.recorded = next_record(world_.registry, at);
    absl::StatusOr<GivenCommands> given =
        give(request.commands(), world_.registry, at, request.owner(), context_.options.shape_bytes_max);
    if (!given.ok()) return given.status();
    if (!given->commands.empty()) {
      if (absl::Status status = room_for(*given); !status.ok()) return status;
    }
    plan.given = *std::move(given);
  }
  absl::StatusOr<AskedQueries> queries = checked_queries(call);
  if (!queries.ok()) return queries.status();
  if (!queries->asked().all().empty()) {
    if (absl::Status status = world_.questions.room(); !status.ok()) return status;
    if (absl::Status status = world_.sequencer.room_for_question(); !status.ok()) return status;
  }
  plan.queries = *std::move(queries);
  return plan;
}

std::optional<v1::Applied> WorldCalls::on(Call<v1::Request, v1::Reply>& call,
                                          std::optional<v1::Applied> carried_out) {
  const v1::Request& request = call.request;
  const bool is_input = !request.commands().empty() || request.ticks() > 0;
  absl::StatusOr<Plan> plan = this->plan(call, is_input && !carried_out);
  if (!plan.ok()) {
    world_.registry.roll_back();
    call.reply(plan.status(), {});
    return std::nullopt;
  }
  world_.registry.keep();
  const auto pending =
      std::make_shared<PendingReply>(std::move(call.reply), world_, context_, account_of(call.role));
  v1::Reply& reply = pending->reply();
  if (carried_out) *reply.mutable_applied() = *std::move(carried_out);
  if (plan->given) {
    *reply.mutable_applied() = std::move(plan->given->applied);
    plan->recorded.mutable_commands()->Swap(call.request.mutable_commands());
    plan->recorded.set_owner(request.owner());
    sequence_list(context_, world_, *std::move(plan->given), std::move(plan->recorded), call.id);
  }
  const v1::Applied applied = reply.applied();
  // No later one is known to anybody, but of another world.
  Tick after = std::min(request.after(), world_.sequencer.next_command_tick());
  reply.set_tick(world_.sequencer.completed());
  if (request.ticks() > 0) {
    const Tick target = reply.applied().tick() - 1 + request.ticks();
    world_.sequencer.step_to(target, pending->wait_for_ticks());
    after = std::max(after, target);
  }
  if (plan->queries.asked().all().empty()) {
    pending->take(plan->queries);
  } else {
    world_.sequencer.ask(world_.questions.queries(std::move(plan->queries), pending->wait_for_results()),
                         after);
  }
  pending->done();
  return is_input ? std::optional(applied) : std::nullopt;
}

void WorldCalls::on(Call<v1::PauseRequest, v1::PauseReply>& call) {
  world_.sequencer.pause(with_tick(std::move(call.reply)));
}

void WorldCalls::on(Call<v1::ResumeRequest, v1::ResumeReply>& call) {
  Sequencer& sequencer = world_.sequencer;
  const absl::Status status = sequencer.resume(call.request.real_time_factor(), now_);
  if (status.ok()) world_.meter.start(sequencer.completed(), now_);
  with_tick(std::move(call.reply))(status, sequencer.completed());
}

// What is held is taken down as it is now, and the servers are asked before they are granted any of it.
void WorldCalls::on(Call<v1::SnapshotRequest, SnapshotChunks>& call) {
  if (absl::Status status = world_.questions.room(); !status.ok()) return call.reply(status, {});
  const Tick tick = world_.sequencer.certain();
  SnapshotChunks chunks = head_chunks(with_held(world_, world_.registry.catalogue()), world_.settings(),
                                      world_.anchor, tick, world_.registry.shapes().at(tick));
  world_.sequencer.ask_first(world_.questions.snapshot(
      v1::SnapshotQuery(),
      [chunks = std::move(chunks), reply = std::move(call.reply)](
          const absl::Status& status, std::vector<v1::SnapshotChunk> of_servers) mutable {
        if (!status.ok()) return reply(status, {});
        std::move(of_servers.begin(), of_servers.end(), std::back_inserter(chunks));
        chunks.push_back(end_chunk(chunks.size()));
        reply(status, chunks);
      }));
}

}  // namespace tessera
