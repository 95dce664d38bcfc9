#include "lpss/base/nearest_word.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace tessera {
namespace {

constexpr std::size_t kWordMax = 64;  // longer ones are no misspelt words

// Levenshtein's distance.
std::size_t distance(absl::string_view a, absl::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t n = 0; n < row.size(); ++n) row[n] = n;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

absl::string_view nearest_word(absl::string_view word, std::span<const absl::string_view> known) {
  if (word.size() > kWordMax) return {};
  std::size_t best = word.size() / 3 + 2;
  absl::string_view nearest;
  for (const absl::string_view candidate : known) {
    const std::size_t letters = distance(word, candidate);
    if (letters >= best) continue;
    best = letters;
    nearest = candidate;
  }
  return nearest;
}

}  // namespace tessera
