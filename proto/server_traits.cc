#include "proto/server_traits.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <set>

namespace tessera {
namespace {

bool is_word(absl::string_view text) {
  constexpr absl::string_view kPunctuation = "._-/";
  return !text.empty() && std::ranges::all_of(text, [&](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || kPunctuation.find(c) != kPunctuation.npos;
  });
}

}  // namespace

absl::Status check_labels(const Labels& labels) {
  if (labels.size() > kLabelsMax) {
    return absl::InvalidArgumentError(
        absl::StrCat("the ", labels.size(), " labels must be at most ", kLabelsMax));
  }
  std::set<absl::string_view> keys;
  for (const absl::string_view label : labels) {
    if (label.size() > kLabelBytesMax) {
      return absl::InvalidArgumentError(
          absl::StrCat("a label of ", label.size(), " bytes must have at most ", kLabelBytesMax));
    }
    const std::size_t equals = label.find('=');
    const absl::string_view key = label.substr(0, equals);
    if (equals == label.npos || !is_word(key) || !is_word(label.substr(equals + 1))) {
      return absl::InvalidArgumentError(absl::StrCat("the label \"", absl::CHexEscape(label),
                                                     "\" must be key=value, of letters, digits and . _ - /"));
    }
    if (!keys.insert(key).second)
      return absl::InvalidArgumentError(absl::StrCat("the label \"", key, "\" is given twice"));
  }
  return absl::OkStatus();
}

bool has_all(const Labels& labels, const Labels& required) {
  return std::ranges::all_of(
      required, [&](const std::string& label) { return std::ranges::find(labels, label) != labels.end(); });
}

}  // namespace tessera
