#include "daemon/monitor.h"

#include <CivetServer.h>
#include <absl/strings/str_cat.h>
#include <prometheus/text_serializer.h>

#include <utility>

#include "daemon/address.h"
#include "daemon/process_metrics.h"

namespace tessera {
namespace {

constexpr std::chrono::minutes kStandstillMax(10);

constexpr const char* kThreads = "8";
constexpr const char* kPatienceMs = "2000";  // with a client that does not take its answer

struct Page {
  int code = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

Page page_of(const absl::Status& status) {
  if (status.ok()) return {.body = "ok\n"};
  return {.code = 503, .body = absl::StrCat(status.message(), "\n")};
}

Page metrics_page(const Monitored& monitored) {
  absl::StatusOr<std::vector<prometheus::MetricFamily>> families = monitored.metrics();
  if (!families.ok()) return page_of(families.status());
  for (prometheus::MetricFamily& family : process_metrics()) families->push_back(std::move(family));
  return {.type = "text/plain; version=0.0.4; charset=utf-8",
          .body = prometheus::TextSerializer().Serialize(*families)};
}

}  // namespace

absl::Status Pulse::alive() const {
  const auto still = std::chrono::steady_clock::now() - last_.load();
  if (still <= kStandstillMax) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("the main loop has been blocked for ", still / std::chrono::seconds(1), " s"));
}

class Monitor::Handler : public CivetHandler {
 public:
  Handler(std::function<Page()> page, std::optional<Tokens> tokens)
      : page_(std::move(page)), tokens_(std::move(tokens)) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    const char* shown = mg_get_header(connection, "Authorization");
    const bool is_known = !tokens_ || (shown != nullptr && tokens_->role_of_header(shown));
    const Page page =
        is_known ? page_() : Page{.code = 401, .body = "send a token: Authorization: Bearer TOKEN\n"};
    mg_printf(
        connection, "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nConnection: close\r\n\r\n",
        page.code, mg_get_response_code_text(connection, page.code), page.type.c_str(), page.body.size());
    mg_write(connection, page.body.data(), page.body.size());
    return true;
  }

 private:
  const std::function<Page()> page_;
  const std::optional<Tokens> tokens_;  // those that may read it; none: everyone
};

std::string Monitor::url() const { return absl::StrCat(is_locked_ ? "https://" : "http://", address(), "/"); }

Monitor::Monitor() = default;
Monitor::~Monitor() = default;

absl::StatusOr<std::unique_ptr<Monitor>> Monitor::open(const std::string& address,
                                                       const std::optional<ServerKeys>& keys,
                                                       Monitored monitored) {
  if (!parse_listen_address(address) || address.find(',') != std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", address, "' is not a valid address for metrics: use host:port"));
  }
  std::unique_ptr<Monitor> monitor(new Monitor());
  try {
    monitor->server_ = std::make_unique<CivetServer>(std::vector<std::string>{
        "listening_ports", kBehindDoor, "num_threads", kThreads, "request_timeout_ms", kPatienceMs});
  } catch (const CivetException&) {
    return absl::UnavailableError("cannot serve metrics: no port of loopback is free");
  }
  const auto serve = [&](const char* path, std::function<Page()> page,
                         const std::optional<Tokens>& tokens = {}) {
    monitor->handlers_.push_back(std::make_unique<Handler>(std::move(page), tokens));
    monitor->server_->addHandler(path, *monitor->handlers_.back());
  };
  serve("/healthz$", [alive = monitored.alive] { return page_of(alive()); });
  serve("/readyz$", [ready = monitored.ready] { return page_of(ready()); });
  const std::optional<Tokens> tokens = keys ? std::optional(keys->tokens) : std::nullopt;
  serve(
      "/metrics$", [monitored = std::move(monitored)] { return metrics_page(monitored); }, tokens);
  absl::StatusOr<std::unique_ptr<HttpDoor>> door =
      HttpDoor::open(address, monitor->server_->getListeningPorts().front(), keys);
  if (absl::IsUnavailable(door.status())) {
    return absl::UnavailableError(absl::StrCat("metrics: ", door.status().message()));
  }
  if (!door.ok()) return door.status();
  monitor->door_ = *std::move(door);
  monitor->is_locked_ = keys.has_value();
  return monitor;
}

}  // namespace tessera
