// What a misspelt word was meant to be, for messages.
#pragma once

#include <absl/strings/string_view.h>

#include <span>
#include <string>

namespace tessera {

// The known word that takes the fewest letters to change, add or leave out; the first one of several. Empty
// where all are far: more than two letters and a third of the word.
absl::string_view nearest_word(absl::string_view word, std::span<const absl::string_view> known);

}  // namespace tessera
