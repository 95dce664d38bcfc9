#include "daemon/http_door.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <openssl/bio.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/locks.h"
#include "daemon/metric_families.h"
#include "daemon/monitor.h"
#include "daemon/open_files.h"
#include "daemon/test_https.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"
#include "transport/dds_network.h"
#include "transport/descriptor.h"

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

Descriptor connected_to(const std::string& text) {
  const ListenAddress place = parse_listen_address(text).value();
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(place.port));
  Descriptor client(socket(AF_INET, SOCK_STREAM, 0));
  EXPECT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  return client;
}

// A stranger that has finished the handshake.
class IdleTls {
 public:
  explicit IdleTls(const std::string& address)
      : context_(SSL_CTX_new(TLS_client_method()), &SSL_CTX_free),
        bio_(BIO_new_ssl_connect(context_.get()), &BIO_free_all) {
    BIO_set_conn_hostname(bio_.get(), address.c_str());
    is_connected_ = BIO_do_connect(bio_.get()) == 1;
  }

  bool is_connected() const { return is_connected_; }
  void send(const std::string& bytes) { BIO_write(bio_.get(), bytes.data(), static_cast<int>(bytes.size())); }

 private:
  std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context_;
  std::unique_ptr<BIO, decltype(&BIO_free_all)> bio_;
  bool is_connected_ = false;
};

class HttpDoorTest : public ::testing::Test {
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

TEST_F(HttpDoorTest, MetricsAreForWhoShowsAToken) {
  EXPECT_THAT(monitor_->url(), HasSubstr("https://127.0.0.1:"));
  const HttpAnswer whole = get("/metrics", header_of("observe"));
  EXPECT_EQ(whole.code, 200);
  EXPECT_THAT(whole.body, HasSubstr(absl::StrCat("tessera_test_", kFamilies - 1, " 3\n")));
  EXPECT_EQ(get("/metrics").code, 401);
  EXPECT_EQ(get("/metrics", "Authorization: Bearer guessed\r\n").code, 401);
  EXPECT_EQ(get("/healthz").code, 200);
  EXPECT_EQ(get("/readyz").code, 200);
}

TEST_F(HttpDoorTest, SpeaksOnlyTls) {
  char error[256] = "";
  const ListenAddress place = parse_listen_address(monitor_->address()).value();
  mg_connection* plain = mg_download(place.host.c_str(), place.port, /*use_ssl=*/0, error, sizeof error,
                                     "GET /healthz HTTP/1.0\r\n\r\n");
  EXPECT_EQ(plain, nullptr);
  EXPECT_EQ(get("/healthz").code, 200);
}

TEST_F(HttpDoorTest, HasTheCertificateOfItsAuthorityAndName) {
  const TestKeys others;
  const std::string foreign = (others.folder() / "authority" / kAuthorityFile).string();
  EXPECT_EQ(https_request(monitor_->address(), foreign, kDaemonName, get_request("/healthz")).code, 0);
  EXPECT_EQ(https_request(monitor_->address(), authority(), "elsewhere", get_request("/healthz")).code, 0);
  EXPECT_EQ(https_request(monitor_->address(), authority(), "localhost", get_request("/healthz")).code, 200);
}

// Connections that say nothing, or end in the middle, keep nobody else out.
TEST_F(HttpDoorTest, StrangersThatSayNothingKeepNobodyOut) {
  std::vector<Descriptor> silent;
  for (int n = 0; n < 100; ++n) {
    silent.push_back(connected_to(monitor_->address()));
    if (n % 3 == 0) {
      ASSERT_EQ(send(silent.back().get(), "\x16\x03\x01", 3, MSG_NOSIGNAL), 3);
    }
    if (n % 3 == 1) silent.back() = Descriptor();
  }
  EXPECT_EQ(get("/healthz").code, 200);
  silent.clear();
  EXPECT_EQ(get("/metrics", header_of("admin")).code, 200);
}

TEST_F(HttpDoorTest, AThousandIdleConnectionsKeepNobodyOut) {
  ASSERT_GT(raise_open_files_max(), 2000u);
  std::vector<IdleTls> idle;
  for (int n = 0; n < 1000; ++n) {
    idle.emplace_back(monitor_->address());
    ASSERT_TRUE(idle.back().is_connected()) << n;
    if (n % 100 == 99) {
      EXPECT_EQ(get("/healthz").code, 200) << n;
    }
  }
  EXPECT_EQ(get("/metrics", header_of("observe")).code, 200);
}

TEST_F(HttpDoorTest, RequestsThatDoNotEndKeepNobodyOut) {
  std::vector<IdleTls> slow;
  for (int n = 0; n < 100; ++n) {
    slow.emplace_back(monitor_->address());
    slow.back().send(n % 2 == 0 ? "GET /healthz HTTP/1.1\r\nHost: lo"
                                : "POST /healthz HTTP/1.1\r\nContent-Length: 100\r\n\r\nthe first bytes");
  }
  EXPECT_EQ(get("/healthz").code, 200);
}

TEST_F(HttpDoorTest, RequestsAreBounded) {
  const HttpAnswer answer = get("/healthz", absl::StrCat("Content-Length: ", 1 << 20, "\r\n"));
  EXPECT_EQ(answer.code, 413);
  EXPECT_THAT(answer.body, HasSubstr("at most 16384 bytes"));
  EXPECT_EQ(get("/healthz", absl::StrCat("A: ", std::string(1 << 20, 'x'), "\r\n")).code, 413);
}

// Without keys, too.
TEST(HttpDoorWithoutKeysTest, AThousandIdleConnectionsKeepNobodyOut) {
  ASSERT_GT(raise_open_files_max(), 2000u);
  const auto monitor = Monitor::open("127.0.0.1:0", std::nullopt, well());
  ASSERT_TRUE(monitor.ok()) << monitor.status();
  std::vector<Descriptor> idle;
  for (int n = 0; n < 1000; ++n) idle.push_back(connected_to((*monitor)->address()));
  EXPECT_EQ(http_get((*monitor)->address(), "/healthz").code, 200);
  const HttpAnswer metrics = http_get((*monitor)->address(), "/metrics");
  EXPECT_THAT(metrics.body, HasSubstr(absl::StrCat("tessera_test_", kFamilies - 1, " 3\n")));
}

// One that sends a request and says that no more comes gets its answer.
TEST(HttpDoorWithoutKeysTest, AnswersWhoHasEndedItsSide) {
  const auto monitor = Monitor::open("127.0.0.1:0", std::nullopt, well());
  ASSERT_TRUE(monitor.ok()) << monitor.status();
  const Descriptor client = connected_to((*monitor)->address());
  const std::string request = get_request("/healthz");
  ASSERT_EQ(send(client.get(), request.data(), request.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(request.size()));
  shutdown(client.get(), SHUT_WR);
  std::string answer;
  char buffer[4096];
  for (ssize_t got = 0; (got = recv(client.get(), buffer, sizeof buffer, 0)) > 0;) {
    answer.append(buffer, static_cast<std::size_t>(got));
  }
  EXPECT_THAT(answer, HasSubstr("200 OK"));
}

TEST_F(HttpDoorTest, KeysThatDoNotBelongTogetherAreAnError) {
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
