#include "viewer/web_server.h"

#include <CivetServer.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <utility>

#include "client_sdk/src/status_json.h"
#include "daemon/http_door.h"
#include "viewer/json.h"
#include "viewer/visitors.h"

// The web UI as one compressed file (page.S).
extern "C" const char tessera_page_begin[];
extern "C" const char tessera_page_end[];

namespace tessera::viewer {
namespace {

constexpr absl::Duration kStatusPeriod = absl::Milliseconds(500);
constexpr int kPagesMax = 32;
constexpr int kThreads = kPagesMax + 8;  // each tab occupies one; the others answer plain requests
constexpr std::size_t kMessageBytesMax = 1 << 16;
constexpr std::size_t kFormBytesMax = 4096;
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

constexpr absl::string_view kRecordings = "/recordings/";
constexpr absl::string_view kPlainText = "Content-Type: text/plain\r\n";
constexpr absl::string_view kHtml = "Content-Type: text/html; charset=utf-8\r\n";

absl::string_view header(const mg_connection* connection, const char* name) {
  const char* value = mg_get_header(connection, name);
  return value == nullptr ? absl::string_view() : absl::string_view(value);
}

// Who asks, and under which name.
struct Doorkeeper {
  Hosts hosts;
  Visitors visitors;

  bool knows_host(const mg_connection* connection) const {
    return hosts.allows(std::string(header(connection, "Host")));
  }
  std::optional<ClientRole> role_of(const mg_connection* connection) const {
    return visitors.role_of(header(connection, "Authorization"), header(connection, "Cookie"));
  }
  // False, and an answer that says so, for a request under a name that is not one of this server's.
  bool admits_host(mg_connection* connection) const {
    if (knows_host(connection)) return true;
    reply(connection, "403 Forbidden", kPlainText,
          "this name is not one of the web UI's: use an IP address, or start it with --allow-host NAME\n");
    return false;
  }
};

class PageHandler final : public CivetHandler {
 public:
  explicit PageHandler(const Doorkeeper& doorkeeper) : doorkeeper_(doorkeeper) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    if (!doorkeeper_.admits_host(connection)) return true;
    if (absl::string_view(mg_get_request_info(connection)->local_uri) != "/") {
      reply(connection, "404 Not Found", kPlainText, "there is no such page\n");
    } else if (!doorkeeper_.role_of(connection)) {
      reply(connection, "401 Unauthorized", kHtml,
            login_page("This world is shown to those who have a token."));
    } else {
      reply(connection, "200 OK", "Content-Type: text/html; charset=utf-8\r\nContent-Encoding: gzip\r\n",
            {tessera_page_begin, static_cast<std::size_t>(tessera_page_end - tessera_page_begin)});
    }
    return true;
  }

 private:
  const Doorkeeper& doorkeeper_;
};

// Takes the token of the login page, and gives a cookie for it.
class LoginHandler final : public CivetHandler {
 public:
  explicit LoginHandler(const Doorkeeper& doorkeeper) : doorkeeper_(doorkeeper) {}

  bool handlePost(CivetServer*, mg_connection* connection) override {
    if (!doorkeeper_.admits_host(connection)) return true;
    std::array<char, kFormBytesMax> form{};
    std::size_t size = 0;
    for (int got = 1; got > 0 && size < form.size(); size += static_cast<std::size_t>(std::max(got, 0))) {
      got = mg_read(connection, form.data() + size, form.size() - size);
    }
    std::array<char, kFormBytesMax> token{};
    const int length = mg_get_var(form.data(), size, "token", token.data(), token.size());
    const std::optional<std::string> cookie =
        doorkeeper_.visitors.cookie_for({token.data(), static_cast<std::size_t>(std::max(length, 0))});
    if (cookie) {
      reply(connection, "303 See Other", absl::StrCat("Location: /\r\nSet-Cookie: ", *cookie, "\r\n"), "");
    } else {
      reply(connection, "401 Unauthorized", kHtml, login_page("This token is not known here."));
    }
    return true;
  }

 private:
  const Doorkeeper& doorkeeper_;
};

class StatusHandler final : public CivetHandler {
 public:
  StatusHandler(const Doorkeeper& doorkeeper, const live::ClusterMonitor& monitor)
      : doorkeeper_(doorkeeper), monitor_(monitor) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    if (!doorkeeper_.admits_host(connection)) return true;
    if (!doorkeeper_.role_of(connection)) {
      reply(connection, "401 Unauthorized", kPlainText, "send a token: Authorization: Bearer TOKEN\n");
      return true;
    }
    const std::shared_ptr<const live::ClusterReport> report = monitor_.latest();
    const bool answers = report->answer.ok();
    const nlohmann::json told =
        answers ? to_json(report->cluster) : nlohmann::json{{"error", std::string(report->answer.message())}};
    reply(connection, answers ? "200 OK" : "503 Service Unavailable", "Content-Type: application/json\r\n",
          absl::StrCat(dump(told), "\n"));
    return true;
  }

 private:
  const Doorkeeper& doorkeeper_;
  const live::ClusterMonitor& monitor_;
};

// GET /recordings/NAME.mcap: a file to keep.
class RecordingHandler final : public CivetHandler {
 public:
  RecordingHandler(const Doorkeeper& doorkeeper, const Recorder& recorder)
      : doorkeeper_(doorkeeper), recorder_(recorder) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    if (!doorkeeper_.admits_host(connection)) return true;
    if (!doorkeeper_.role_of(connection)) {
      reply(connection, "401 Unauthorized", kPlainText, "send a token: Authorization: Bearer TOKEN\n");
      return true;
    }
    absl::string_view name = mg_get_request_info(connection)->local_uri;
    const bool is_recording = absl::ConsumePrefix(&name, kRecordings) && absl::ConsumeSuffix(&name, ".mcap");
    const absl::StatusOr<std::filesystem::path> file = recorder_.file(is_recording ? std::string(name) : "");
    if (!file.ok()) {
      reply(connection, "404 Not Found", kPlainText, absl::StrCat(file.status().message(), "\n"));
      return true;
    }
    mg_send_mime_file2(connection, file->c_str(), "application/octet-stream",
                       "Content-Disposition: attachment\r\nX-Content-Type-Options: nosniff\r\n");
    return true;
  }

 private:
  const Doorkeeper& doorkeeper_;
  const Recorder& recorder_;
};

class LiveHandler final : public CivetWebSocketHandler {
 public:
  LiveHandler(const Doorkeeper& doorkeeper, Client& client, const PageOptions& options)
      : doorkeeper_(doorkeeper), client_(client), options_(options) {}

  void report(const std::shared_ptr<const live::ClusterReport>& report) {
    const std::lock_guard lock(mutex_);
    report_ = report;
    for (const auto& [connection, session] : sessions_) session->report(report);
  }

  // Accept only the web UI of this server: other sites must not control the world through a visitor's
  // browser.
  bool handleConnection(CivetServer*, const mg_connection* connection) override {
    if (!doorkeeper_.knows_host(connection) || !doorkeeper_.role_of(connection)) return false;
    const absl::string_view origin = header(connection, "Origin");
    const char* scheme = doorkeeper_.visitors.must_log_in() ? "https://" : "http://";
    if (!origin.empty() && origin != absl::StrCat(scheme, header(connection, "Host"))) return false;
    const std::lock_guard lock(mutex_);
    return sessions_.size() < static_cast<std::size_t>(kPagesMax);
  }

  void handleReadyState(CivetServer*, mg_connection* connection) override {
    const auto send = [connection](int opcode) {
      return [connection, opcode](const std::string& bytes) {
        mg_websocket_write(connection, opcode, bytes.data(), bytes.size());
      };
    };
    PageOptions options = options_;
    options.read_only |= doorkeeper_.role_of(connection) < ClientRole::kControl;
    options.may_load &= doorkeeper_.role_of(connection) >= ClientRole::kAdmin;
    const std::lock_guard lock(mutex_);
    sessions_[connection] = std::make_shared<PageSession>(
        client_, options, PageSocket{send(MG_WEBSOCKET_OPCODE_TEXT), send(MG_WEBSOCKET_OPCODE_BINARY)},
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

  const Doorkeeper& doorkeeper_;
  Client& client_;
  const PageOptions options_;
  std::mutex mutex_;
  std::shared_ptr<const live::ClusterReport> report_ = std::make_shared<live::ClusterReport>();
  std::map<const mg_connection*, std::shared_ptr<PageSession>> sessions_;
};

}  // namespace

class WebServer::Impl {
 public:
  Impl(Hosts hosts, const std::optional<ServerKeys>& keys, Client& client, const PageOptions& options)
      : doorkeeper_{std::move(hosts), Visitors(keys)},
        live_(doorkeeper_, client, options),
        monitor_(client, kStatusPeriod, [this](const auto& report) { live_.report(report); }),
        status_(doorkeeper_, monitor_),
        recordings_(doorkeeper_, *options.recorder),
        page_(doorkeeper_),
        login_(doorkeeper_),
        server_(std::vector<std::string>{
            "listening_ports", kBehindDoor, "num_threads", absl::StrCat(kThreads), "tcp_nodelay", "1",
            "enable_websocket_ping_pong", "yes", "websocket_timeout_ms", "10000"}) {
    server_.addHandler("/", page_);
    server_.addHandler("/login", login_);
    server_.addHandler("/status", status_);
    server_.addHandler("/recordings", recordings_);
    server_.addWebSocketHandler("/live", live_);
  }

  // What browsers come to, in front of this server.
  absl::Status open_door(const std::string& address, const std::optional<ServerKeys>& keys) {
    absl::StatusOr<std::unique_ptr<HttpDoor>> door =
        HttpDoor::open(address, server_.getListeningPorts().front(), keys);
    if (!door.ok()) return door.status();
    door_ = *std::move(door);
    url_ = absl::StrCat(keys ? "https://" : "http://", door_->address(), "/");
    return absl::OkStatus();
  }

  const std::string& url() const { return url_; }

 private:
  const Doorkeeper doorkeeper_;
  LiveHandler live_;
  live::ClusterMonitor monitor_;
  StatusHandler status_;
  RecordingHandler recordings_;
  PageHandler page_;
  LoginHandler login_;
  CivetServer server_;
  std::unique_ptr<HttpDoor> door_;
  std::string url_;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

absl::StatusOr<std::unique_ptr<WebServer>> WebServer::open(const std::string& address, Hosts hosts,
                                                           const std::optional<ServerKeys>& keys,
                                                           Client& client, const PageOptions& options) {
  try {
    auto impl = std::make_unique<Impl>(std::move(hosts), keys, client, options);
    if (absl::Status status = impl->open_door(address, keys); !status.ok()) return status;
    return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
  } catch (const CivetException&) {
    return absl::UnavailableError("cannot serve the web UI: no port of loopback is free");
  }
}

const std::string& WebServer::url() const { return impl_->url(); }

}  // namespace tessera::viewer
