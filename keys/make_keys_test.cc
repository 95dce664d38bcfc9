#include "keys/make_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "keys/gate.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

mode_t mode_of(const std::filesystem::path& file) {
  struct stat found {};
  return stat(file.c_str(), &found) == 0 ? found.st_mode & 0777 : 0;
}

TEST(MakeKeysTest, PrivateFilesAreTheOwnersAlone) {
  const TestKeys keys;
  for (const char* folder : {"authority", "daemon", "gateway", "viewer", "observe", "control", "admin"}) {
    EXPECT_EQ(mode_of(keys.folder() / folder), 0700u) << folder;
    EXPECT_EQ(mode_of(keys.folder() / folder / kKeyFile), 0600u) << folder;
  }
  for (const char* file : {"daemon/tokens", "gateway/tokens", "viewer/tokens", "observe/token",
                           "control/token", "admin/token"}) {
    EXPECT_EQ(mode_of(keys.folder() / file), 0600u) << file;
  }
}

TEST(MakeKeysTest, LeavesFoldersThatAreThereAlone) {
  const TestKeys keys;
  const std::string before = read_key_file(keys.folder() / "admin" / kKeyFile).value();
  EXPECT_EQ(make_keys({.folder = keys.folder()}).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(add_client(keys.folder(), "admin", ClientRole::kAdmin, 1).code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(read_key_file(keys.folder() / "admin" / kKeyFile).value(), before);
}

TEST(MakeKeysTest, RefusesNamesThatLeadElsewhere) {
  const TestKeys keys;
  for (const char* name :
       {"", ".", "..", "../escaped", "a/b", "a,URI:urn:tessera:role:admin", "tessera-daemon"}) {
    EXPECT_EQ(add_client(keys.folder(), name, ClientRole::kObserve, 1).code(),
              absl::StatusCode::kInvalidArgument)
        << name;
  }
  for (const char* host : {"", "a,DNS:b", "a b", "tessera-daemon"}) {
    EXPECT_EQ(make_keys({.folder = keys.folder() / "new", .hosts = {host}}).code(),
              absl::StatusCode::kInvalidArgument)
        << host;
  }
}

TEST(MakeKeysTest, ANewClientIsKnown) {
  const TestKeys keys;
  ASSERT_TRUE(add_client(keys.folder(), "lab", ClientRole::kObserve, 30).ok());
  const std::string token = read_key_file(keys.folder() / "lab" / kTokenFile).value();
  const auto known = read_server_keys(keys.folder(), kDaemonFolder);
  ASSERT_TRUE(known.ok()) << known.status();
  EXPECT_EQ(known->tokens.role_of(token.substr(0, token.size() - 1)), ClientRole::kObserve);
  EXPECT_EQ(known->tokens.role_of(token), std::nullopt);
  EXPECT_EQ(known->tokens.role_of(""), std::nullopt);
  const auto gateway = read_server_keys(keys.folder(), kGatewayFolder);
  ASSERT_TRUE(gateway.ok()) << gateway.status();
  EXPECT_EQ(gateway->tokens.role_of(token.substr(0, token.size() - 1)), ClientRole::kObserve);
}

TEST(MakeKeysTest, KeysAreDescribed) {
  const TestKeys keys({"lab.example.org", "10.1.2.3"});
  const std::string text = describe_keys(keys.folder()).value();
  EXPECT_THAT(text, HasSubstr("admin  until "));
  EXPECT_THAT(text, HasSubstr("urn:tessera:role:observe"));
  EXPECT_THAT(text, HasSubstr("lab.example.org"));
  EXPECT_THAT(text, HasSubstr("10.1.2.3"));
  EXPECT_EQ(describe_keys(keys.folder() / "none").status().code(), absl::StatusCode::kNotFound);
}

TEST(TokensTest, LinesThatAreNoneAreNamed) {
  EXPECT_TRUE(Tokens::parse("# nothing\n\n").ok());
  for (const char* text : {"# x\nadmin", "# x\nroot 00", "# x\nadmin abc lab"}) {
    EXPECT_THAT(std::string(Tokens::parse(text).status().message()), HasSubstr("line 2")) << text;
  }
}

}  // namespace
}  // namespace tessera
