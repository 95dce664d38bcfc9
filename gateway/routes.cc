#include "gateway/routes.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <utility>

#include "proto/status.h"

namespace tessera {
namespace {

using Clock = std::chrono::system_clock;

absl::Status is_closing_error() { return stands_by_error("the gateway is shutting down"); }

}  // namespace

Routes::Routes(const std::vector<std::string>& coordinators, const ClientKeys& own, Log log,
               std::chrono::milliseconds wait_max)
    : onward_(own.without_identity()),
      log_(std::move(log)),
      wait_max_(wait_max),
      addresses_(absl::StrJoin(coordinators, ",")) {
  for (const std::string& address : coordinators) {
    coordinators_.push_back(
        {std::make_shared<DaemonLines>(address, onward_), v1::Tessera::NewStub(open_line(address, own))});
  }
  thread_ = std::thread([this] { run(); });
}

Routes::~Routes() {
  {
    const std::lock_guard lock(mutex_);
    is_closing_ = true;
  }
  changed_.notify_all();
  thread_.join();
  for (const Wanted& wanted : std::exchange(wanted_, {})) wanted.found(is_closing_error());
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return users_ == 0; });
}

Routes::User::User(Routes& routes) : routes_(routes) {
  const std::lock_guard lock(routes_.mutex_);
  ++routes_.users_;
}

Routes::User::~User() {
  const std::lock_guard lock(routes_.mutex_);
  if (--routes_.users_ == 0) routes_.changed_.notify_all();
}

// For whoever holds the lock.
absl::Status Routes::nobody_leads() const {
  return stands_by_error(absl::StrCat("no coordinator answers the gateway at ", addresses_,
                                      why_not_.empty() ? "" : ": ", why_not_));
}

absl::Status Routes::ready() const {
  const std::lock_guard lock(mutex_);
  return is_known_ ? absl::OkStatus() : nobody_leads();
}

// For whoever holds the lock, and knows who leads.
absl::StatusOr<Routes::Lines> Routes::known(std::optional<std::uint64_t> node) const {
  if (!node) return coordinators_[leader_].lines;
  const auto server = servers_.find(*node);
  if (server != servers_.end()) return server->second;
  return absl::UnavailableError(absl::StrCat("the cluster has no sector server ", *node));
}

void Routes::find(std::optional<std::uint64_t> node, Time deadline, Found found) {
  std::unique_lock lock(mutex_);
  if (is_closing_) {
    lock.unlock();
    return found(is_closing_error());
  }
  if (is_known_) {
    if (absl::StatusOr<Lines> lines = known(node); lines.ok()) {
      lock.unlock();
      return found(std::move(lines));
    }
  }
  wanted_.push_back({node, std::min(deadline, Clock::now() + wait_max_), std::move(found)});
  lock.unlock();
  changed_.notify_all();
}

void Routes::doubt(const Lines& lines) {
  {
    const std::lock_guard lock(mutex_);
    if (coordinators_[leader_].lines != lines) return;
    is_known_ = false;
    ++doubts_;
  }
  changed_.notify_all();
}

std::optional<v1::StatusReply> Routes::ask() {
  const std::size_t first = [this] {
    const std::lock_guard lock(mutex_);
    return leader_;
  }();
  for (std::size_t n = 0; n < coordinators_.size(); ++n) {
    const std::size_t place = (first + n) % coordinators_.size();
    grpc::ClientContext context;
    context.set_deadline(Clock::now() + kAskMax);
    v1::StatusReply reply;
    const grpc::Status status = coordinators_[place].own->GetStatus(&context, v1::StatusRequest(), &reply);
    const std::lock_guard lock(mutex_);
    why_not_ = status.error_message();
    if (!status.ok()) continue;
    leader_ = place;
    return reply;
  }
  return std::nullopt;
}

// Lines to servers that are known already stay.
void Routes::take(const std::optional<v1::StatusReply>& status) {
  if (!status) return;
  std::map<std::uint64_t, Lines> servers;
  const std::lock_guard lock(mutex_);
  for (const v1::ServerStatus& server : status->servers()) {
    const auto before = servers_.find(server.node());
    servers.emplace(server.node(),
                    before != servers_.end() && before->second->address() == server.stream_address()
                        ? before->second
                        : std::make_shared<DaemonLines>(server.stream_address(), onward_));
  }
  servers_ = std::move(servers);
}

void Routes::answer(std::vector<Wanted> wanted, bool is_known) {
  std::vector<std::pair<Found, absl::StatusOr<Lines>>> answers;
  {
    const std::lock_guard lock(mutex_);
    for (Wanted& each : wanted) {
      if (is_known) {
        answers.emplace_back(std::move(each.found), known(each.node));
      } else if (each.deadline <= Clock::now()) {
        answers.emplace_back(std::move(each.found), nobody_leads());
      } else {
        wanted_.push_back(std::move(each));
      }
    }
  }
  for (auto& [found, lines] : answers) found(std::move(lines));
}

void Routes::run() {
  std::optional<std::size_t> told;  // who leads
  bool has_told = false;
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_closing_ || !is_known_ || !wanted_.empty(); });
    if (is_closing_) return;
    std::vector<Wanted> wanted = std::exchange(wanted_, {});
    const std::uint64_t doubts = doubts_;
    lock.unlock();
    const std::optional<v1::StatusReply> status = ask();
    take(status);
    lock.lock();
    is_known_ = status && doubts == doubts_;
    const std::optional<std::size_t> now = status ? std::optional(leader_) : std::nullopt;
    absl::StatusOr<std::string> leader = nobody_leads();
    if (now) leader = coordinators_[*now].lines->address();
    lock.unlock();
    if (!has_told || now != told) {
      log_(leader);
      told = now;
      has_told = true;
    }
    answer(std::move(wanted), status.has_value());
    lock.lock();
    // Not more often, whatever clients ask for.
    changed_.wait_for(lock, kAskEvery, [this] { return is_closing_; });
  }
}

}  // namespace tessera
