#include "client_sdk/src/request_session.h"

#include <algorithm>
#include <utility>

#include "proto/session_header.h"
#include "proto/status.h"

namespace tessera {
namespace {

// How long nobody of several may lead before requests are given up.
constexpr absl::Duration kNobodyLeadsMax = absl::Seconds(60);
constexpr absl::Duration kFindMax = absl::Seconds(1);
// A coordinator that is replaced is back within a second or two, and on a busy machine somewhat later.
constexpr absl::Duration kReplacedMax = absl::Seconds(10);
constexpr absl::Duration kLookAgain = absl::Milliseconds(50);  // whether it is back, or the client closes

}  // namespace

RequestSession::RequestSession(std::shared_ptr<Coordinators> coordinators)
    : coordinators_(std::move(coordinators)), thread_([this] { run(); }) {}

RequestSession::~RequestSession() {
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
    if (context_ != nullptr) context_->TryCancel();
  }
  changed_.notify_all();
  thread_.join();
}

void RequestSession::send(v1::Request request, Done done) {
  static_cast<void>(enqueue(std::move(request), std::move(done)));
  writer_wakes_.notify_one();
}

std::uint64_t RequestSession::enqueue(v1::Request request, Done done) {
  std::uint64_t number = 0;
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return pending_.size() < kWindow || is_closing_; });
    number = ++last_number_;
    request.set_number(number);
    pending_.emplace(number, Pending{std::move(request), std::move(done)});
  }
  changed_.notify_all();
  return number;
}

// All that have not been written to the stream, in their order. For whoever holds `writing_`: the stream
// stays meanwhile. The one that reads finds out where this fails.
void RequestSession::send_all() {
  for (;;) {
    v1::Request request;
    Stream* stream = nullptr;
    {
      const std::lock_guard lock(mutex_);
      stream = stream_;
      if (stream == nullptr || !has_unsent()) return;
      const auto next = pending_.upper_bound(written_);
      written_ = next->first;
      request = next->second.request;
      const std::uint64_t up_to = pending_.begin()->first - 1;
      request.set_answered(up_to);
      for (const std::uint64_t number : std::exchange(answered_, {})) {
        if (number > up_to) request.add_also_answered(number);
      }
    }
    if (!stream->Write(request)) return;
  }
}

absl::StatusOr<v1::Reply> RequestSession::call(v1::Request request, absl::Duration timeout) {
  struct Waiting {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<absl::StatusOr<v1::Reply>> reply;
  };
  const auto waiting = std::make_shared<Waiting>();
  const std::uint64_t number = enqueue(std::move(request), [waiting](absl::StatusOr<v1::Reply> reply) {
    const std::lock_guard lock(waiting->mutex);
    waiting->reply = std::move(reply);
    waiting->changed.notify_one();
  });
  {
    // At once where there is a stream; one that comes later writes all.
    const std::lock_guard writing(writing_);
    send_all();
  }
  std::unique_lock lock(waiting->mutex);
  const auto is_there = [&] { return waiting->reply.has_value(); };
  if (timeout == absl::InfiniteDuration()) {
    waiting->changed.wait(lock, is_there);
  } else if (!waiting->changed.wait_for(lock, absl::ToChronoNanoseconds(timeout), is_there)) {
    lock.unlock();
    forget(number);
    return coordinators_->explained(absl::DeadlineExceededError(""), timeout);
  }
  if (waiting->reply->ok()) return *std::move(*waiting->reply);
  return coordinators_->explained(waiting->reply->status(), timeout);
}

void RequestSession::forget(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  if (pending_.erase(number) == 0) return;
  answered_.push_back(number);
  changed_.notify_all();
}

void RequestSession::run() {
  absl::Time lost = absl::InfiniteFuture();  // since when no reply has come
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return is_closing_ || !pending_.empty(); });
      if (is_closing_) break;
    }
    const std::size_t place = coordinators_->find(absl::Now() + kFindMax);
    const grpc::Status status = serve(place);
    coordinators_->leave(place, status);
    {
      const std::lock_guard lock(mutex_);
      if (is_closing_) break;
      if (has_replied_) lost = absl::InfiniteFuture();
      lost = std::min(lost, absl::Now());
      if (pending_.empty()) continue;
    }
    if (absl::Now() - lost < kNobodyLeadsMax && is_worth_another(place, status)) continue;
    fail_all(from_grpc(status));
    lost = absl::InfiniteFuture();
  }
  fail_all(absl::CancelledError("the client was closed"));
}

// One stream, until it is lost.
grpc::Status RequestSession::serve(std::size_t place) {
  grpc::ClientContext context;
  context.AddMetadata(kSessionHeader, coordinators_->session());
  const auto stream = coordinators_->stub(place).Session(&context);
  {
    const std::lock_guard lock(mutex_);
    stream_ = stream.get();
    context_ = &context;
    written_ = 0;
    has_replied_ = false;
    if (is_closing_) context.TryCancel();
  }
  // The coordinator takes no more than its client reads replies, so nothing that writes may hold that up.
  std::thread writer([this] { send_while_connected(); });
  for (v1::Reply reply; stream->Read(&reply);) take(std::exchange(reply, {}));
  {
    const std::lock_guard lock(mutex_);
    stream_ = nullptr;
  }
  writer_wakes_.notify_one();
  writer.join();
  // Whoever writes ends, for the stream is broken.
  const std::lock_guard writing(writing_);
  grpc::Status status = stream->Finish();
  const std::lock_guard lock(mutex_);
  context_ = nullptr;
  return status;
}

void RequestSession::send_while_connected() {
  for (;;) {
    {
      const std::lock_guard writing(writing_);
      send_all();
    }
    std::unique_lock lock(mutex_);
    writer_wakes_.wait(lock, [this] { return stream_ == nullptr || has_unsent(); });
    if (stream_ == nullptr) return;
  }
}

void RequestSession::take(v1::Reply reply) {
  Done done;
  {
    const std::lock_guard lock(mutex_);
    has_replied_ = true;
    const auto found = pending_.find(reply.number());
    if (found == pending_.end()) return;
    done = std::move(found->second.done);
    pending_.erase(found);
    answered_.push_back(reply.number());
  }
  changed_.notify_all();
  if (reply.code() == 0) return done(std::move(reply));
  done(absl::Status(static_cast<absl::StatusCode>(reply.code()), reply.message()));
}

bool RequestSession::is_worth_another(std::size_t place, const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE && !status.ok()) return false;
  if (!stands_by(status)) return comes_back(place);
  return coordinators_->are_several() && Coordinators::is_worth_another(absl::Now() + kNobodyLeadsMax);
}

bool RequestSession::comes_back(std::size_t place) {
  const absl::Time end = absl::Now() + kReplacedMax;
  while (absl::Now() < end && !is_closing()) {
    if (coordinators_->comes_back(place, absl::Now() + kLookAgain)) return true;
  }
  return false;
}

bool RequestSession::is_closing() {
  const std::lock_guard lock(mutex_);
  return is_closing_;
}

void RequestSession::fail_all(const absl::Status& status) {
  std::map<std::uint64_t, Pending> failed;
  {
    const std::lock_guard lock(mutex_);
    failed = std::exchange(pending_, {});
    for (const auto& [number, request] : failed) answered_.push_back(number);
  }
  changed_.notify_all();
  const absl::Status told = status.ok() ? absl::UnavailableError("the stream has ended") : status;
  for (auto& [number, request] : failed) request.done(told);
}

}  // namespace tessera
