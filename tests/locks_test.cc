// The edge of a cluster has locks: what strangers, and clients of each role, can do with real processes.
#include <absl/strings/str_cat.h>

#include "daemon/test_https.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr absl::Duration kShort = absl::Milliseconds(300);  // for an answer that does not come

std::string token_of(const TestKeys& keys, const std::string& client) {
  std::string token = read_key_file(keys.folder() / client / kTokenFile).value_or("\n");
  token.pop_back();
  return token;
}

std::string authority_of(const TestKeys& keys) {
  return (keys.folder() / "authority" / kAuthorityFile).string();
}

class LocksTest : public ::testing::Test {
 protected:
  void SetUp() override {
    cluster_ = start_cluster(2, {.keys = keys_.folder()});
    ASSERT_TRUE(cluster_.client);
    WorldDescription world = flat_world(16);
    add(world, solid("box", box(1, 1, 1), 10, {{0, 0, 0}, {0, 0, 5}}));
    ASSERT_THAT(cluster_.client->load(world).status(), IsOk());
  }
  absl::StatusOr<std::unique_ptr<Client>> connect(const std::string& client) const {
    return Client::connect(cluster_.processes->address(), kPatience, keys_.folder() / client);
  }

  const TestKeys keys_;
  Cluster cluster_;
};

TEST_F(LocksTest, EachRoleMayDoItsOwn) {
  const auto observer = connect("observe");
  ASSERT_THAT(observer.status(), IsOk());
  EXPECT_THAT((*observer)->status().status(), IsOk());
  EXPECT_THAT((*observer)->apply_impulse("box", {1, 0, 0}).status(),
              IsStatus(absl::StatusCode::kPermissionDenied, "it needs control"));
  EXPECT_THAT((*observer)->shutdown(), IsStatus(absl::StatusCode::kPermissionDenied, "it needs admin"));
  const auto controller = connect("control");
  ASSERT_THAT(controller.status(), IsOk());
  EXPECT_THAT((*controller)->apply_impulse("box", {1, 0, 0}).status(), IsOk());
  EXPECT_THAT((*controller)->unload(), IsStatus(absl::StatusCode::kPermissionDenied, "it needs admin"));
  // Streams come from the servers, which look at keys, too.
  const auto frames = (*observer)->watch_bodies({});
  ASSERT_THAT(frames.status(), IsOk());
  EXPECT_THAT((*controller)->step(3).status(), IsOk());
  for (Tick tick = 0; tick < 3;) {
    const auto frame = (*frames)->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    tick = frame->tick;
  }
  EXPECT_THAT(cluster_.client->unload(), IsOk());
}

TEST_F(LocksTest, StrangersGetNoAnswer) {
  const std::string& address = cluster_.processes->address();
  EXPECT_THAT(Client::connect(address, kShort).status(),
              IsStatus(absl::StatusCode::kUnavailable, "may want keys (--keys FOLDER or TESSERA_KEYS)"));
  const TestKeys others;
  EXPECT_THAT(Client::connect(address, kShort, others.folder()).status(),
              IsStatus(absl::StatusCode::kUnavailable, "those of another cluster"));
  const auto status = cluster_.client->status();
  ASSERT_THAT(status.status(), IsOk());
  for (const ServerStatus& server : status->servers) {
    EXPECT_THAT(Client::connect(server.stream_address, kShort).status().code(),
                absl::StatusCode::kUnavailable);
  }
}

TEST_F(LocksTest, TheCommandTakesKeys) {
  const std::string& address = cluster_.processes->address();
  const std::string observer = (keys_.folder() / "observe").string();
  EXPECT_EQ(run_tessera({"status", "--connect", address, "--keys", observer}).code, 0);
  const Outcome denied = run_tessera({"unload", "--connect", address, "--keys", observer});
  EXPECT_EQ(denied.code, 1);
  EXPECT_THAT(denied.output, HasSubstr("the role observe may not do this: it needs admin"));
  EXPECT_EQ(run_tessera({"status", "--connect", address}).code, 1);
  EXPECT_THAT(run_tessera({"status", "--keys", "/nowhere"}).output,
              HasSubstr("/nowhere/authority.pem is missing"));
}

TEST(LockedPageTest, BrowsersShowATokenAndHaveItsRole) {
  const TestKeys keys;
  const Cluster cluster = start_cluster(1, {.page = "127.0.0.1:0", .keys = keys.folder()});
  ASSERT_TRUE(cluster.client);
  const std::string& url = cluster.processes->page_url();
  ASSERT_THAT(url, HasSubstr("https://127.0.0.1:"));
  const std::string address = url.substr(8, url.size() - 9);
  const auto ask = [&](const std::string& request) {
    return https_request(address, authority_of(keys), "localhost", request);
  };
  const std::string bearer = absl::StrCat("Authorization: Bearer ", token_of(keys, "observe"), "\r\n");
  EXPECT_EQ(ask(get_request("/status")).code, 401);
  EXPECT_EQ(ask(get_request("/status", "Authorization: Bearer guessed\r\n")).code, 401);
  EXPECT_EQ(ask(get_request("/status", bearer)).code, 200);
  const HttpAnswer door = ask(get_request("/"));
  EXPECT_EQ(door.code, 401);
  EXPECT_THAT(door.body, HasSubstr("<form"));

  const auto log_in = [&](const std::string& token) {
    const std::string form = "token=" + token;
    return ask(
        absl::StrCat("POST /login HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: "
                     "application/x-www-form-urlencoded\r\nContent-Length: ",
                     form.size(), "\r\n\r\n", form));
  };
  EXPECT_EQ(log_in("guessed").code, 401);
  EXPECT_EQ(log_in(std::string(3000, 'x')).code, 401);
  EXPECT_NE(log_in(std::string(100'000, 'x')).code, 303);
  const HttpAnswer in = log_in(token_of(keys, "control"));
  EXPECT_EQ(in.code, 303);
  EXPECT_THAT(in.body, HasSubstr("Set-Cookie: tessera-token="));
  const std::string cookie = absl::StrCat("Cookie: tessera-token=", token_of(keys, "control"), "\r\n");
  EXPECT_EQ(ask(get_request("/", cookie)).code, 200);

  // The web socket, over which a tab controls the world: hello says what it may do.
  const auto open_live = [&](const std::string& headers) {
    return ask(get_request("/live",
                           absl::StrCat("Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: "
                                        "13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n",
                                        headers)));
  };
  EXPECT_NE(open_live("").code, 101);
  EXPECT_NE(open_live(absl::StrCat(cookie, "Origin: https://attacker.example\r\n")).code, 101);
}

// Daemons that are told to listen beyond loopback want keys.
TEST(BeyondLoopbackTest, DaemonsWithoutKeysDoNotStart) {
  for (const char* daemon : {"tessera-coordinator", "tessera-sector-server"}) {
    for (const char* option : {"--listen", "--metrics-address"}) {
      Process refused(daemon, {option, "0.0.0.0:0"});
      EXPECT_EQ(refused.wait(), 1);
      EXPECT_THAT(refused.output(), HasSubstr("tessera keys create"));
      EXPECT_THAT(refused.output(), HasSubstr("insecure = true"));
    }
  }
  Process up("tessera", {"up", "--listen", "0.0.0.0:0", "--no-page"});
  EXPECT_EQ(up.wait(), 1);
  EXPECT_THAT(up.output(), HasSubstr("tessera keys create"));
}

TEST(BeyondLoopbackTest, DaemonsStartWithKeysOrWhereInsecurityIsWrittenDown) {
  const TestKeys keys;
  for (const std::vector<std::string>& locks :
       {std::vector<std::string>{"--insecure"}, {"--keys", keys.folder().string()}}) {
    std::vector<std::string> arguments = {"up", "--listen", "0.0.0.0:0", "--no-page"};
    arguments.insert(arguments.end(), locks.begin(), locks.end());
    Process up("tessera", arguments);
    EXPECT_TRUE(up.await_output("a cluster is up")) << up.output();
    up.process().signal(SIGINT);
    up.wait();
  }
}

}  // namespace
}  // namespace tessera
