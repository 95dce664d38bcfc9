#include "viewer/visitors.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>

#include <algorithm>

namespace tessera::viewer {
namespace {

constexpr absl::string_view kCookie = "tessera-token=";

}  // namespace

Visitors::Visitors(const std::optional<ServerKeys>& keys) {
  if (keys) tokens_ = keys->tokens;
}

std::optional<ClientRole> Visitors::role_of(absl::string_view authorization,
                                            absl::string_view cookies) const {
  if (!tokens_) return ClientRole::kAdmin;
  std::optional<ClientRole> role = tokens_->role_of_header(authorization);
  for (absl::string_view cookie : absl::StrSplit(cookies, ';')) {
    cookie = absl::StripAsciiWhitespace(cookie);
    if (absl::ConsumePrefix(&cookie, kCookie)) role = std::max(role, tokens_->role_of(cookie));
  }
  return role;
}

// Other sites cannot send it, scripts cannot read it, and it ends with the browser.
std::optional<std::string> Visitors::cookie_for(absl::string_view token) const {
  if (!tokens_ || !tokens_->role_of(token)) return std::nullopt;
  return absl::StrCat(kCookie, token, "; Path=/; Secure; HttpOnly; SameSite=Strict");
}

std::string login_page(absl::string_view notice) {
  return absl::StrCat(
      "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Tessera</title>"
      "<style>body{font:16px sans-serif;margin:20vh auto;max-width:24em;color:#222}"
      "input,button{font:inherit;padding:.4em;width:100%;box-sizing:border-box;margin:.3em 0}</style>"
      "<form method=\"post\" action=\"/login\"><h1>Tessera</h1><p>",
      notice,
      "</p><label>Token <input name=\"token\" type=\"password\" autocomplete=\"current-password\" required "
      "autofocus>"
      "</label><button>Enter</button></form></html>\n");
}

}  // namespace tessera::viewer
