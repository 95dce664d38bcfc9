#include "daemon/tls_door.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon/locks.h"
#include "daemon/metric_families.h"
#include "daemon/monitor.h"
#include "daemon/test_https.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"
#include "transport/dds_network.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kFamilies = 20'000;  // some megabytes, far more than a buffer

Monitored well() {
  return {.metrics =
              [] {
                std::vector<prometheus::MetricFamily> families;
                for (std::size_t n = 0; n < kFamilies; ++n) {
                  families.push_back(gauge(absl::StrCat("tessera_test_", n), std::string(100, 'x'), 3));
                }
                return families;
              },
          .alive = [] { return absl::OkStatus(); },
          .ready = [] { return absl::OkStatus(); }};
}

class TlsDoorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = Monitor::open("127.0.0.1:0", server_keys(), well());
    ASSERT_TRUE(opened.ok()) << opened.status();
    monitor_ = *std::move(opened);
  }
  std::optional<ServerKeys> server_keys() { return read_server_keys(keys_.folder(), kDaemonFolder).value(); }
  std::string authority() const { return (keys_.folder() / "authority" / kAuthorityFile).string(); }
  std::string header_of(const std::string& client) const {
    std::string token = read_key_file(keys_.folder() / client / kTokenFile).value();
    token.pop_back();
    return absl::StrCat("Authorization: Bearer ", token, "\r\n");
  }
  HttpAnswer get(const std::string& path, const std::string& headers = "") {
    return https_request(monitor_->address(), authority(), kDaemonName, get_request(path, headers));
  }

  const TestKeys keys_;
  std::unique_ptr<Monitor> monitor_;
};

TEST_F(TlsDoorTest, MetricsAreForWhoShowsAToken) {
  EXPECT_THAT(monitor_->url(), HasSubstr("https://127.0.0.1:"));
  const HttpAnswer whole = get("/metrics", header_of("observe"));
  EXPECT_EQ(whole.code, 200);
  EXPECT_THAT(whole.body, HasSubstr(absl::StrCat("tessera_test_", kFamilies - 1, " 3\n")));
  EXPECT_EQ(get("/metrics").code, 401);
  EXPECT_EQ(get("/metrics", "Authorization: Bearer guessed\r\n").code, 401);
  EXPECT_EQ(get("/healthz").code, 200);
  EXPECT_EQ(get("/readyz").code, 200);
}

TEST_F(TlsDoorTest, SpeaksOnlyTls) {
  char error[256] = "";
  const ListenAddress place = parse_listen_address(monitor_->address()).value();
  mg_connection* plain = mg_download(place.host.c_str(), place.port, /*use_ssl=*/0, error, sizeof error,
                                     "GET /healthz HTTP/1.0\r\n\r\n");
  EXPECT_EQ(plain, nullptr);
  EXPECT_EQ(get("/healthz").code, 200);
}

TEST_F(TlsDoorTest, HasTheCertificateOfItsAuthorityAndName) {
  const TestKeys others;
  const std::string foreign = (others.folder() / "authority" / kAuthorityFile).string();
  EXPECT_EQ(https_request(monitor_->address(), foreign, kDaemonName, get_request("/healthz")).code, 0);
  EXPECT_EQ(https_request(monitor_->address(), authority(), "elsewhere", get_request("/healthz")).code, 0);
  EXPECT_EQ(https_request(monitor_->address(), authority(), "localhost", get_request("/healthz")).code, 200);
}

// Connections that say nothing, or end in the middle, keep nobody else out.
TEST_F(TlsDoorTest, StrangersThatSayNothingKeepNobodyOut) {
  const ListenAddress place = parse_listen_address(monitor_->address()).value();
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(place.port));
  std::vector<int> silent;
  for (int n = 0; n < 100; ++n) {
    silent.push_back(socket(AF_INET, SOCK_STREAM, 0));
    ASSERT_EQ(connect(silent.back(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    if (n % 3 == 0) {
      ASSERT_EQ(send(silent.back(), "\x16\x03\x01", 3, MSG_NOSIGNAL), 3);
    }
    if (n % 3 == 1) close(std::exchange(silent.back(), -1));
  }
  EXPECT_EQ(get("/healthz").code, 200);
  for (const int descriptor : silent) {
    if (descriptor >= 0) close(descriptor);
  }
  EXPECT_EQ(get("/metrics", header_of("admin")).code, 200);
}

TEST_F(TlsDoorTest, KeysThatDoNotBelongTogetherAreAnError) {
  std::filesystem::copy_file(keys_.folder() / "admin" / kKeyFile, keys_.folder() / "daemon" / kKeyFile,
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(Monitor::open("127.0.0.1:0", server_keys(), well()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(LocksTest, BeyondLoopbackKeysAreNeeded) {
  for (const char* address : {"127.0.0.1:7300", "127.8.0.1:0", "localhost:1", "[::1]:7300", "", "nonsense"}) {
    EXPECT_TRUE(open_locks({}, kDaemonFolder, {address}).ok()) << address;
  }
  for (const char* address :
       {"0.0.0.0:7300", "[::]:0", "10.0.0.2:7300", "lab.example.org:1", "128.0.0.1:1"}) {
    const absl::Status refused = open_locks({}, kDaemonFolder, {"127.0.0.1:0", address}).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << address;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("tessera keys create")) << address;
    EXPECT_TRUE(open_locks({.insecure = true}, kDaemonFolder, {address}).ok()) << address;
  }
  const TestKeys keys;
  EXPECT_TRUE(
      open_locks({.folder = keys.folder().string()}, kDaemonFolder, {"0.0.0.0:0"}).value().has_value());
  EXPECT_EQ(open_locks({.folder = "/nowhere"}, kDaemonFolder, {}).status().code(),
            absl::StatusCode::kNotFound);
}

TEST(LocksTest, BeyondLoopbackTheBusIsClosed) {
  DdsNetwork network;
  EXPECT_TRUE(lock_bus({}, std::nullopt, network).ok());
  network.interface = "eth0";
  const absl::Status refused = lock_bus({}, std::nullopt, network);
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("tessera keys create"));
  EXPECT_TRUE(lock_bus({.insecure = true}, std::nullopt, network).ok());
  EXPECT_EQ(network.keys, "");
  const TestKeys keys;
  const std::optional<ServerKeys> read = read_server_keys(keys.folder(), kDaemonFolder).value();
  EXPECT_TRUE(lock_bus({}, read, network).ok());
  EXPECT_EQ(network.keys, (keys.folder() / "daemon").string());
}

}  // namespace
}  // namespace tessera
