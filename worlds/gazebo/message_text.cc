#include "worlds/gazebo/message_text.h"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tessera::gazebo {
namespace {

constexpr std::size_t kDepthMax = 16;

class Reader {
 public:
  explicit Reader(absl::string_view text) : text_(text) {}

  absl::StatusOr<MessageFields> read() {
    while (skip(), place_ < text_.size()) {
      if (text_[place_] == '}') {
        if (scope_.empty()) return error();
        ++place_;
        scope_.pop_back();
        continue;
      }
      const std::string name = word();
      skip_blanks();
      const bool has_colon = take(':');
      skip_blanks();
      if (name.empty() || scope_.size() == kDepthMax) return error();
      scope_.push_back(name);
      if (take('{')) continue;
      std::string value = text_.substr(place_, 1).find_first_of("\"'") == 0 ? quoted() : word();
      if (!has_colon || is_broken_) return error();
      fields_.emplace_back(absl::StrJoin(scope_, "."), std::move(value));
      scope_.pop_back();
    }
    if (!scope_.empty()) return error();
    return std::move(fields_);
  }

 private:
  void skip_blanks() {
    while (place_ < text_.size() && absl::ascii_isspace(static_cast<unsigned char>(text_[place_]))) ++place_;
  }
  // What may be between fields.
  void skip() {
    for (skip_blanks(); place_ < text_.size() && (text_[place_] == ',' || text_[place_] == ';');
         skip_blanks())
      ++place_;
  }
  bool take(char c) {
    const bool is_there = place_ < text_.size() && text_[place_] == c;
    if (is_there) ++place_;
    return is_there;
  }
  std::string word() {
    const std::size_t first = place_;
    const auto belongs = [](char c) {
      return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '+' ||
             c == '.';
    };
    while (place_ < text_.size() && belongs(text_[place_])) ++place_;
    if (first == place_) is_broken_ = true;
    return std::string(text_.substr(first, place_ - first));
  }
  std::string quoted() {
    const char quote = text_[place_++];
    const std::size_t end = std::min(text_.find(quote, place_), text_.size());
    std::string inner(text_.substr(place_, end - place_));
    is_broken_ |= end == text_.size();
    place_ = std::min(end + 1, text_.size());
    return inner;
  }
  absl::Status error() const {
    return absl::InvalidArgumentError(
        absl::StrCat("character ", place_ + 1, " of its message: it is no text of a message"));
  }

  absl::string_view text_;
  std::size_t place_ = 0;
  bool is_broken_ = false;
  std::vector<std::string> scope_;
  MessageFields fields_;
};

}  // namespace

absl::StatusOr<MessageFields> read_message_text(absl::string_view text) { return Reader(text).read(); }

std::optional<double> number_of_text(absl::string_view text) {
  if (text == "true") return 1;
  if (text == "false") return 0;
  double number = 0;
  if (!absl::SimpleAtod(text, &number) || !std::isfinite(number)) return std::nullopt;
  return number;
}

std::optional<double> number_in(const MessageFields& fields, absl::string_view name) {
  const auto found = std::ranges::find(fields, name, &MessageFields::value_type::first);
  return found == fields.end() ? std::nullopt : number_of_text(found->second);
}

}  // namespace tessera::gazebo
