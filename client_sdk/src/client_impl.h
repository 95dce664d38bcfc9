// How a client makes its calls: with deadlines, and requests once, over connections that may be lost.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <absl/time/time.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "client_sdk/src/coordinators.h"
#include "client_sdk/src/query_list.h"
#include "client_sdk/src/request_session.h"
#include "client_sdk/src/subscriber.h"
#include "keys/keys_folder.h"
#include "proto/disk.h"
#include "proto/status.h"
#include "proto/whole_file.h"
#include "tessera.grpc.pb.h"
#include "tessera/client.h"

namespace tessera {

class Client::Impl {
 public:
  Impl(ClientKeys keys, std::shared_ptr<Coordinators> coordinators)
      : keys_(std::move(keys)), coordinators_(std::move(coordinators)), session_(coordinators_) {}

  template <typename Request, typename Reply>
  using Method = Coordinators::Method<Request, Reply>;

  template <typename Request, typename Reply>
  absl::StatusOr<Reply> call(Method<Request, Reply> method, const Request& request, absl::Duration timeout) {
    return coordinators_->call(method, request, timeout);
  }

  // With results of the kinds that were asked for. A request that asks after what it does waits for nothing
  // else; `sees_own`: one that only asks sees what this client has done before.
  absl::StatusOr<Answers> run(v1::Request request, absl::Duration timeout, bool sees_own) {
    if (sees_own) request.set_after(last_applied_);
    v1::Request queries;  // as they are compared with the results
    *queries.mutable_queries() = request.queries();
    absl::StatusOr<v1::Reply> reply = session_.call(std::move(request), timeout);
    if (!reply.ok()) return reply.status();
    if (absl::Status status = check_results(queries, *reply); !status.ok()) return status;
    note(reply->applied().tick());
    return Answers(std::make_shared<const v1::Reply>(*std::move(reply)));
  }

  void send(v1::Request request, std::function<void(absl::StatusOr<Answers>)> done) {
    v1::Request queries;
    *queries.mutable_queries() = request.queries();
    session_.send(std::move(request), [this, queries = std::move(queries),
                                       done = std::move(done)](absl::StatusOr<v1::Reply> reply) {
      if (!reply.ok()) return done(coordinators_->explained(reply.status(), absl::InfiniteDuration()));
      if (absl::Status status = check_results(queries, *reply); !status.ok()) return done(status);
      note(reply->applied().tick());
      done(Answers(std::make_shared<const v1::Reply>(*std::move(reply))));
    });
  }

  absl::StatusOr<SnapshotSummary> snapshot(WholeFile& file, absl::Duration timeout) {
    grpc::ClientContext context;
    set_deadline(context, timeout);
    const auto stream = coordinators_->leader(timeout).Snapshot(&context, v1::SnapshotRequest());
    SnapshotSummary summary;
    for (v1::SnapshotPiece piece; stream->Read(&piece);) {
      if (absl::Status status = file.append(piece.bytes()); !status.ok()) {
        context.TryCancel();
        static_cast<void>(stream->Finish());
        return status;
      }
      summary.tick = piece.tick();
      summary.bytes += piece.bytes().size();
    }
    if (const absl::Status status = from_grpc(stream->Finish()); !status.ok())
      return coordinators_->explained(status, timeout);
    return summary;
  }

  absl::StatusOr<v1::LoadReply> restore(const std::filesystem::path& file, bool replace,
                                        absl::Duration timeout) {
    grpc::ClientContext context;
    set_deadline(context, timeout);
    v1::LoadReply reply;
    const auto stream = coordinators_->leader(timeout).Restore(&context, &reply);
    v1::RestoreRequest request;
    request.set_replace(replace);
    bool is_taken = true;  // otherwise Finish() says why not
    const absl::Status read = system_disk().read(file, [&](std::string_view bytes) {
      request.set_bytes(std::string(bytes));
      is_taken = is_taken && stream->Write(request);
      return absl::OkStatus();
    });
    if (!read.ok()) {
      context.TryCancel();
      static_cast<void>(stream->Finish());
      return read;
    }
    stream->WritesDone();
    if (const absl::Status status = from_grpc(stream->Finish()); !status.ok())
      return coordinators_->explained(status, timeout);
    return reply;
  }

  template <typename Request, typename Reply>
  absl::StatusOr<Tick> tick_of(Method<Request, Reply> method, const Request& request,
                               absl::Duration timeout) {
    const absl::StatusOr<Reply> reply = call(method, request, timeout);
    if (!reply.ok()) return reply.status();
    return reply->tick();
  }

  Subscriber subscriber() const { return {keys_, coordinators_}; }

 private:
  void note(Tick applied) {
    Tick last = last_applied_;
    while (last < applied && !last_applied_.compare_exchange_weak(last, applied)) {
    }
  }

  static void set_deadline(grpc::ClientContext& context, absl::Duration timeout) {
    if (timeout != absl::InfiniteDuration()) context.set_deadline(absl::ToChronoTime(absl::Now() + timeout));
  }

  const ClientKeys keys_;
  const std::shared_ptr<Coordinators> coordinators_;  // streams have them, too
  std::atomic<Tick> last_applied_ = 0;                // of this client's commands
  RequestSession session_;                            // ends first: it calls the others
};

}  // namespace tessera
