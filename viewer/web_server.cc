#include "viewer/web_server.h"

#include <CivetServer.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <map>
#include <mutex>
#include <utility>

#include "client_sdk/src/status_json.h"
#include "viewer/json.h"

// The web UI as one compressed file (page.S).
extern "C" const char tessera_page_begin[];
extern "C" const char tessera_page_end[];

namespace tessera::viewer {
namespace {

constexpr absl::Duration kStatusPeriod = absl::Milliseconds(500);
constexpr int kPagesMax = 32;
constexpr int kThreads = kPagesMax + 8;  // each tab occupies one; the others answer plain requests
constexpr std::size_t kMessageBytesMax = 1 << 16;
constexpr int kTextFrame = 0x80 | MG_WEBSOCKET_OPCODE_TEXT;  // complete, not a fragment
constexpr int kCloseFrame = 0x80 | MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE;

constexpr absl::string_view kHeadersOfAll =
    "Cache-Control: no-cache\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "X-Frame-Options: DENY\r\n"
    "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; "
    "style-src 'unsafe-inline'; img-src data:; connect-src 'self' data:; base-uri 'none'\r\n";

void reply(mg_connection* connection, absl::string_view status, absl::string_view headers,
           absl::string_view body) {
  const std::string head = absl::StrCat("HTTP/1.1 ", status, "\r\n", kHeadersOfAll, headers,
                                        "Content-Length: ", body.size(), "\r\n\r\n");
  mg_write(connection, head.data(), head.size());
  mg_write(connection, body.data(), body.size());
}

// False, and an answer that says so, for a request under a name that is not one of this server's.
bool is_admitted(const Hosts& hosts, mg_connection* connection) {
  const char* host = mg_get_header(connection, "Host");
  if (host != nullptr && hosts.allows(host)) return true;
  reply(connection, "403 Forbidden", "Content-Type: text/plain\r\n",
        "this name is not one of the web UI's: use an IP address, or start it with --allow-host NAME\n");
  return false;
}

class PageHandler final : public CivetHandler {
 public:
  explicit PageHandler(const Hosts& hosts) : hosts_(hosts) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    if (!is_admitted(hosts_, connection)) return true;
    if (absl::string_view(mg_get_request_info(connection)->local_uri) != "/") {
      reply(connection, "404 Not Found", "Content-Type: text/plain\r\n", "there is no such page\n");
    } else {
      reply(connection, "200 OK", "Content-Type: text/html; charset=utf-8\r\nContent-Encoding: gzip\r\n",
            {tessera_page_begin, static_cast<std::size_t>(tessera_page_end - tessera_page_begin)});
    }
    return true;
  }

 private:
  const Hosts& hosts_;
};

class StatusHandler final : public CivetHandler {
 public:
  StatusHandler(const Hosts& hosts, const live::ClusterMonitor& monitor) : hosts_(hosts), monitor_(monitor) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    if (!is_admitted(hosts_, connection)) return true;
    const std::shared_ptr<const live::ClusterReport> report = monitor_.latest();
    const bool answers = report->answer.ok();
    const nlohmann::json told =
        answers ? to_json(report->cluster) : nlohmann::json{{"error", std::string(report->answer.message())}};
    reply(connection, answers ? "200 OK" : "503 Service Unavailable", "Content-Type: application/json\r\n",
          absl::StrCat(dump(told), "\n"));
    return true;
  }

 private:
  const Hosts& hosts_;
  const live::ClusterMonitor& monitor_;
};

class LiveHandler final : public CivetWebSocketHandler {
 public:
  LiveHandler(const Hosts& hosts, Client& client, const PageOptions& options)
      : hosts_(hosts), client_(client), options_(options) {}

  void report(const std::shared_ptr<const live::ClusterReport>& report) {
    const std::lock_guard lock(mutex_);
    report_ = report;
    for (const auto& [connection, session] : sessions_) session->report(report);
  }

  // Accept only the web UI of this server: other sites must not control the world through a visitor's
  // browser.
  bool handleConnection(CivetServer*, const mg_connection* connection) override {
    const char* origin = mg_get_header(connection, "Origin");
    const char* host = mg_get_header(connection, "Host");
    if (host == nullptr || !hosts_.allows(host)) return false;
    if (origin != nullptr && origin != absl::StrCat("http://", host)) return false;
    const std::lock_guard lock(mutex_);
    return sessions_.size() < static_cast<std::size_t>(kPagesMax);
  }

  void handleReadyState(CivetServer*, mg_connection* connection) override {
    const auto send = [connection](int opcode) {
      return [connection, opcode](const std::string& bytes) {
        mg_websocket_write(connection, opcode, bytes.data(), bytes.size());
      };
    };
    const std::lock_guard lock(mutex_);
    sessions_[connection] = std::make_shared<PageSession>(
        client_, options_, PageSocket{send(MG_WEBSOCKET_OPCODE_TEXT), send(MG_WEBSOCKET_OPCODE_BINARY)},
        report_);
  }

  bool handleData(CivetServer*, mg_connection* connection, int bits, char* data, std::size_t size) override {
    bits &= 0xff;
    if (bits == kCloseFrame) return false;
    if (bits != kTextFrame) return (bits & 0x0f) == MG_WEBSOCKET_OPCODE_PONG;
    const std::shared_ptr<PageSession> session = session_of(connection);
    return session && size <= kMessageBytesMax && session->hear({data, size});
  }

  void handleClose(CivetServer*, const mg_connection* connection) override {
    std::shared_ptr<PageSession> ending;  // destroyed without the lock, since that takes a moment
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(connection);
    if (found == sessions_.end()) return;
    ending = std::move(found->second);
    sessions_.erase(found);
  }

 private:
  std::shared_ptr<PageSession> session_of(const mg_connection* connection) {
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(connection);
    return found == sessions_.end() ? nullptr : found->second;
  }

  const Hosts& hosts_;
  Client& client_;
  const PageOptions options_;
  std::mutex mutex_;
  std::shared_ptr<const live::ClusterReport> report_ = std::make_shared<live::ClusterReport>();
  std::map<const mg_connection*, std::shared_ptr<PageSession>> sessions_;
};

}  // namespace

class WebServer::Impl {
 public:
  Impl(const std::string& address, Hosts hosts, Client& client, const PageOptions& options)
      : hosts_(std::move(hosts)),
        live_(hosts_, client, options),
        monitor_(client, kStatusPeriod, [this](const auto& report) { live_.report(report); }),
        status_(hosts_, monitor_),
        page_(hosts_),
        server_(std::vector<std::string>{"listening_ports", address, "num_threads", absl::StrCat(kThreads),
                                         "tcp_nodelay", "1", "enable_websocket_ping_pong", "yes",
                                         "websocket_timeout_ms", "10000"}) {
    server_.addHandler("/", page_);
    server_.addHandler("/status", status_);
    server_.addWebSocketHandler("/live", live_);
    const std::string host = address.substr(0, address.rfind(':'));
    url_ = absl::StrCat("http://", host, ":", server_.getListeningPorts().front(), "/");
  }

  const std::string& url() const { return url_; }

 private:
  const Hosts hosts_;
  LiveHandler live_;
  live::ClusterMonitor monitor_;
  StatusHandler status_;
  PageHandler page_;
  CivetServer server_;
  std::string url_;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

absl::StatusOr<std::unique_ptr<WebServer>> WebServer::open(const std::string& address, Hosts hosts,
                                                           Client& client, const PageOptions& options) {
  try {
    return std::unique_ptr<WebServer>(
        new WebServer(std::make_unique<Impl>(address, std::move(hosts), client, options)));
  } catch (const CivetException&) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", address,
                                               ": the address is in use or does not belong to this machine"));
  }
}

const std::string& WebServer::url() const { return impl_->url(); }

}  // namespace tessera::viewer
