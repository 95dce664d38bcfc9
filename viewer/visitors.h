// Which browser may do what.
#pragma once

#include <absl/strings/string_view.h>

#include <optional>
#include <string>

#include "keys/gate.h"

namespace tessera::viewer {

// With keys, a browser shows one of their tokens: in a header, or in the cookie that the login page sets.
// Without, everyone may do everything.
class Visitors {
 public:
  explicit Visitors(const std::optional<ServerKeys>& keys);

  bool must_log_in() const { return tokens_.has_value(); }
  // Of a request with these headers; empty if it has none. Nullopt for a stranger.
  std::optional<ClientRole> role_of(absl::string_view authorization, absl::string_view cookies) const;
  // The header "Set-Cookie" for `token`, without its name; nullopt for a token that is none.
  std::optional<std::string> cookie_for(absl::string_view token) const;

 private:
  std::optional<Tokens> tokens_;
};

// A page with a form that asks for a token; `notice` stands above it.
std::string login_page(absl::string_view notice);

}  // namespace tessera::viewer
