#include "coordinator/sessions.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "coordinator/limits.h"

namespace tessera {

Sessions::Session& Sessions::touch(std::uint64_t session) {
  const auto [entry, is_new] = sessions_.try_emplace(session);
  if (!is_new) {
    latest_.splice(latest_.begin(), latest_, entry->second.place);
    return entry->second;
  }
  entry->second.place = latest_.insert(latest_.begin(), session);
  if (latest_.size() > kSessionsMax) {
    const auto oldest = sessions_.find(latest_.back());
    for (auto& [number, call] : oldest->second.calls) forget(call);
    sessions_.erase(oldest);
    latest_.pop_back();
  }
  return sessions_.at(session);
}

void Sessions::forget(Call& call) {
  for (const Take& take : std::exchange(call.again, {})) {
    take(absl::AbortedError("this call was made before, and whether it has run is forgotten"), "");
  }
}

void Sessions::forget_old(Session& session) {
  while (session.calls.size() > kAnswersPerSessionMax) {
    const auto oldest = session.calls.begin();
    forget(oldest->second);
    session.forgotten = oldest->first;
    session.calls.erase(oldest);
  }
}

bool Sessions::begin(CallId id, const Take& take) {
  Session& session = touch(id.session);
  const auto found = session.calls.find(id.number);
  if (found != session.calls.end()) {
    Call& call = found->second;
    if (call.is_answered) {
      take(call.status, call.answer);
    } else if (call.again.size() < kCallsAgainMax) {
      call.again.push_back(take);
    } else {
      take(absl::ResourceExhaustedError(
               absl::StrCat("this call is waited for ", kCallsAgainMax, " times already")),
           "");
    }
    return false;
  }
  if (id.number <= session.forgotten) {
    take(absl::AbortedError("this call was made before, and whether it has run is forgotten"), "");
    return false;
  }
  session.calls.emplace(id.number, Call());
  forget_old(session);
  return true;
}

void Sessions::end(CallId id, const absl::Status& status, std::string answer) {
  const auto session = sessions_.find(id.session);
  if (session == sessions_.end()) return;
  const auto found = session->second.calls.find(id.number);
  if (found == session->second.calls.end()) return;
  Call& call = found->second;
  call.is_answered = true;
  call.status = status;
  call.answer = std::move(answer);
  for (const Take& take : std::exchange(call.again, {})) take(call.status, call.answer);
}

void Sessions::remember(CallId id, std::string answer) {
  if (id.session == 0) return;
  Session& session = touch(id.session);
  Call& call = session.calls[id.number];
  call.is_answered = true;
  call.answer = std::move(answer);
  forget_old(session);
}

}  // namespace tessera
