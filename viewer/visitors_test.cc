#include "viewer/visitors.h"

#include <gmock/gmock.h>

namespace tessera::viewer {
namespace {

std::optional<ServerKeys> keys() {
  ServerKeys made;
  made.tokens = Tokens::parse(Tokens::line(ClientRole::kObserve, "look", "lab") +
                              Tokens::line(ClientRole::kAdmin, "all", "boss"))
                    .value();
  return made;
}

TEST(Visitors, MayDoEverythingWhereThereAreNoKeys) {
  const Visitors visitors(std::nullopt);
  EXPECT_FALSE(visitors.must_log_in());
  EXPECT_EQ(visitors.role_of("", ""), ClientRole::kAdmin);
}

TEST(Visitors, HaveTheRoleOfTheTokenThatTheyShow) {
  const Visitors visitors(keys());
  EXPECT_EQ(visitors.role_of("Bearer look", ""), ClientRole::kObserve);
  EXPECT_EQ(visitors.role_of("", "tessera-token=look"), ClientRole::kObserve);
  EXPECT_EQ(visitors.role_of("", "a=b; tessera-token=all; c=d"), ClientRole::kAdmin);
  EXPECT_EQ(visitors.role_of("Bearer look", "tessera-token=all"), ClientRole::kAdmin);
}

TEST(Visitors, AreStrangersOtherwise) {
  const Visitors visitors(keys());
  for (const char* authorization :
       {"", "look", "Bearer", "Bearer ", "Bearer  look", "Basic look", "bearer all "}) {
    EXPECT_EQ(visitors.role_of(authorization, ""), std::nullopt) << authorization;
  }
  for (const char* cookie :
       {"", "look", "token=look", "tessera-token=", "xtessera-token=all", "tessera-token=all2"}) {
    EXPECT_EQ(visitors.role_of("", cookie), std::nullopt) << cookie;
  }
}

TEST(Visitors, GetACookieForATokenOnly) {
  const Visitors visitors(keys());
  EXPECT_EQ(visitors.cookie_for("guessed"), std::nullopt);
  EXPECT_EQ(visitors.cookie_for(""), std::nullopt);
  const std::string cookie = visitors.cookie_for("all").value();
  EXPECT_EQ(visitors.role_of("", cookie), ClientRole::kAdmin);
  EXPECT_THAT(cookie, ::testing::HasSubstr("Secure; HttpOnly; SameSite=Strict"));
}

}  // namespace
}  // namespace tessera::viewer
