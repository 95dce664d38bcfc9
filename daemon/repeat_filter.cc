#include "daemon/repeat_filter.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

// The number of different lines to keep track of; beyond it, all are forgotten.
constexpr std::size_t kDifferentLinesMax = 1024;

// The text without its words that have a digit: numbers, addresses, nodes.
std::string without_numbers(absl::string_view text) {
  std::string result;
  while (!text.empty()) {
    const auto end = std::find_if_not(text.begin(), text.end(), absl::ascii_isalnum);
    const absl::string_view word = text.substr(0, static_cast<std::size_t>(end - text.begin()));
    if (std::none_of(word.begin(), word.end(), absl::ascii_isdigit)) absl::StrAppend(&result, word);
    text.remove_prefix(word.size());
    const auto next = std::find_if(text.begin(), text.end(), absl::ascii_isalnum);
    absl::StrAppend(&result, text.substr(0, static_cast<std::size_t>(next - text.begin())));
    text.remove_prefix(static_cast<std::size_t>(next - text.begin()));
  }
  return result;
}

}  // namespace

void RepeatFilter::sink_it_(const spdlog::details::log_msg& message) {
  if (message.level < spdlog::level::warn) {
    dist_sink::sink_it_(message);
    return;
  }
  if (windows_.size() >= kDifferentLinesMax) windows_.clear();
  const absl::string_view text(message.payload.data(), message.payload.size());
  Window& window = windows_[without_numbers(text)];
  std::size_t left_out = 0;
  if (message.time - window.start >= window_) {
    left_out = window.lines - std::min(window.lines, lines_max_);
    window = {.start = message.time};
  }
  if (++window.lines > lines_max_) return;
  if (left_out == 0) {
    dist_sink::sink_it_(message);
    return;
  }
  const std::string told = absl::StrCat(text, " (", left_out, " similar lines were suppressed)");
  spdlog::details::log_msg copy = message;
  copy.payload = told;
  dist_sink::sink_it_(copy);
}

}  // namespace tessera
