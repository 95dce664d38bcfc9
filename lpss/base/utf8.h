// Whether text can go where only UTF-8 may: messages, JSON, terminals.
#pragma once

#include <absl/strings/string_view.h>

namespace tessera {

// Whether `text` is UTF-8 (RFC 3629): no overlong forms, no surrogates, nothing above U+10FFFF.
bool is_utf8(absl::string_view text);

}  // namespace tessera
