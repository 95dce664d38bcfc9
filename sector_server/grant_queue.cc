#include "sector_server/grant_queue.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

// A coordinator is some ticks ahead of its slowest server.
constexpr std::uint64_t kGrantsAheadMax = 65'536;

}  // namespace

absl::Status GrantQueue::take(v1::Grant grant) {
  const std::uint64_t serial = grant.serial();
  if (serial < next_serial_ || serial - next_serial_ >= kGrantsAheadMax) {
    return absl::InvalidArgumentError(absl::StrCat("grant ", serial, " is not one of the ", kGrantsAheadMax,
                                                   " from ", next_serial_, " on"));
  }
  waiting_.insert_or_assign(serial, std::move(grant));
  return absl::OkStatus();
}

v1::Grant* GrantQueue::begin_next() {
  invariant(has_work(), "a grant begins once it has come");
  if (grant_) return nullptr;
  const auto next = waiting_.begin();
  invariant(next->first == next_serial_, "no grant is left out");
  grant_ = std::move(next->second);
  waiting_.erase(next);
  ++next_serial_;
  has_map_ = grant_->has_map();
  ticks_left_ = grant_->ticks();
  next_question_ = 0;
  return &*grant_;
}

const v1::SectorMap* GrantQueue::take_map() {
  return std::exchange(has_map_, false) ? &grant_->map() : nullptr;
}

std::optional<GrantQueue::GrantedTick> GrantQueue::take_tick() {
  if (ticks_left_ == 0) return std::nullopt;
  const bool is_first = ticks_left_-- == grant_->ticks();
  return GrantedTick{is_first ? &grant_->commands() : nullptr};
}

std::optional<v1::Question> GrantQueue::take_question() {
  invariant(grant_ && ticks_left_ == 0, "questions come after the ticks of their grant");
  std::optional<v1::Question> question;
  if (next_question_ < grant_->questions_size())
    question = std::move(*grant_->mutable_questions(next_question_++));
  if (next_question_ == grant_->questions_size()) grant_.reset();
  return question;
}

v1::Grant GrantQueue::take_rest() {
  invariant(grant_.has_value(), "only what has begun has a rest");
  return *std::exchange(grant_, std::nullopt);
}

}  // namespace tessera
