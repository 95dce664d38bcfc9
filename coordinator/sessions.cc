#include "coordinator/sessions.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "coordinator/limits.h"

namespace tessera {
namespace {

constexpr const char* kForgotten =
    "this request was made before, and whether it was carried out is forgotten";

// With what is worth remembering of it.
v1::Reply kept(const v1::Reply& reply) {
  if (reply.ByteSizeLong() <= kKeptReplyBytesMax) return reply;
  v1::Reply kept;
  *kept.mutable_applied() = reply.applied();
  kept.set_tick(reply.tick());
  return kept;
}

}  // namespace

bool NumberSet::contains(std::uint64_t number) const {
  const auto after = runs_.upper_bound(number);
  return number <= up_to_ || (after != runs_.begin() && std::prev(after)->second >= number);
}

void NumberSet::add(std::uint64_t number) {
  if (contains(number)) return;
  if (number == up_to_ + 1) return add_up_to(number);
  auto after = runs_.upper_bound(number);
  std::uint64_t last = number;
  if (after != runs_.end() && after->first == number + 1) {
    last = after->second;
    after = runs_.erase(after);
  }
  if (after != runs_.begin() && std::prev(after)->second + 1 == number) {
    std::prev(after)->second = last;
  } else {
    runs_.emplace(number, last);
  }
}

void NumberSet::add_up_to(std::uint64_t number) {
  up_to_ = std::max(up_to_, number);
  for (auto run = runs_.begin(); run != runs_.end() && run->first <= up_to_ + 1; run = runs_.erase(run))
    up_to_ = std::max(up_to_, run->second);
}

Sessions::Session& Sessions::touch(std::uint64_t session) {
  const auto [entry, is_new] = sessions_.try_emplace(session);
  if (!is_new) {
    latest_.splice(latest_.begin(), latest_, entry->second.place);
    return entry->second;
  }
  entry->second.place = latest_.insert(latest_.begin(), session);
  if (latest_.size() > kSessionsMax) {
    const auto oldest = sessions_.find(latest_.back());
    for (auto& [number, request] : oldest->second.requests) {
      for (const Reply& reply : std::exchange(request.again, {})) reply(absl::AbortedError(kForgotten), {});
    }
    sessions_.erase(oldest);
    latest_.pop_back();
  }
  return sessions_.at(session);
}

void Sessions::forget_answered(Session& session, const v1::Request& request) {
  session.answered.add_up_to(request.answered());
  const auto is_over = [](const Request& made) { return made.is_answered || made.carried_out; };
  for (auto made = session.requests.begin();
       made != session.requests.end() && made->first <= request.answered();)
    made = is_over(made->second) ? session.requests.erase(made) : std::next(made);
  for (const std::uint64_t number : request.also_answered()) {
    session.answered.add(number);
    const auto made = session.requests.find(number);
    if (made != session.requests.end() && is_over(made->second)) session.requests.erase(made);
  }
}

Sessions::Admission Sessions::admit(Call& call) {
  if (call.id.session == 0) return {};
  const auto refuse = [&](const absl::Status& status) {
    call.reply(status, {});
    return Admission{.is_taken = true, .carried_out = {}};
  };
  if (call.id.number == 0)
    return refuse(absl::InvalidArgumentError("number = 0 must be at least 1: requests are counted"));
  Session& session = touch(call.id.session);
  forget_answered(session, call.request);
  const auto found = session.requests.find(call.id.number);
  if (found == session.requests.end()) {
    if (session.answered.contains(call.id.number)) return refuse(absl::AbortedError(kForgotten));
    if (session.requests.size() >= kUnansweredMax || session.answered.gaps() > kUnansweredMax) {
      return refuse(absl::ResourceExhaustedError(absl::StrCat(
          session.requests.size(), " requests of this client have replies that it has not taken, ",
          "and may be at most ", kUnansweredMax)));
    }
  } else if (found->second.is_answered) {
    call.reply(found->second.status, found->second.reply);
    return {.is_taken = true, .carried_out = {}};
  } else if (!found->second.carried_out) {
    if (found->second.again.size() >= kCallsAgainMax) {
      return refuse(absl::ResourceExhaustedError(
          absl::StrCat("this request is waited for ", kCallsAgainMax, " times already")));
    }
    found->second.again.push_back(call.reply);
    return {.is_taken = true, .carried_out = {}};
  }
  Request& request = session.requests[call.id.number];
  call.reply = [this, id = call.id, reply = std::move(call.reply)](const absl::Status& status,
                                                                   const v1::Reply& answer) {
    reply(status, answer);
    end(id, status, answer);
  };
  return {.is_taken = false, .carried_out = std::exchange(request.carried_out, std::nullopt)};
}

void Sessions::take_answered(const Call& call) {
  const auto session = sessions_.find(call.id.session);
  if (session != sessions_.end()) forget_answered(session->second, call.request);
}

void Sessions::end(RequestId id, const absl::Status& status, const v1::Reply& reply) {
  const auto session = sessions_.find(id.session);
  if (session == sessions_.end()) return;
  const auto found = session->second.requests.find(id.number);
  if (found == session->second.requests.end()) return;
  Request& request = found->second;
  for (const Reply& again : std::exchange(request.again, {})) again(status, reply);
  if (session->second.answered.contains(id.number)) {  // the client has given it up
    session->second.requests.erase(found);
    return;
  }
  request.is_answered = true;
  request.status = status;
  request.reply = kept(reply);
}

void Sessions::note(RequestId id, const v1::Applied& applied) {
  const auto session = sessions_.find(id.session);
  if (session == sessions_.end()) return;
  const auto found = session->second.requests.find(id.number);
  if (found != session->second.requests.end()) found->second.applied = applied;
}

void Sessions::for_each(const std::function<void(RequestId, const v1::Applied&)>& visit) const {
  for (const std::uint64_t session : latest_) {
    for (const auto& [number, request] : sessions_.at(session).requests) {
      if (request.applied) visit({session, number}, *request.applied);
    }
  }
}

void Sessions::remember(RequestId id, const v1::Applied& applied) {
  if (id.session == 0) return;
  Session& session = touch(id.session);
  Request& request = session.requests[id.number];
  request.applied = request.carried_out = applied;
  if (session.requests.size() <= kUnansweredMax) return;
  session.answered.add(session.requests.begin()->first);
  session.requests.erase(session.requests.begin());
}

}  // namespace tessera
