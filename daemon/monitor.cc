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

// Connections that ask nothing have a thread each, for so long: probes must find one that is free.
constexpr const char* kThreads = "32";
constexpr const char* kPatienceMs = "2000";

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
  explicit Handler(std::function<Page()> page) : page_(std::move(page)) {}

  bool handleGet(CivetServer*, mg_connection* connection) override {
    const Page page = page_();
    mg_printf(
        connection, "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nConnection: close\r\n\r\n",
        page.code, mg_get_response_code_text(connection, page.code), page.type.c_str(), page.body.size());
    mg_write(connection, page.body.data(), page.body.size());
    return true;
  }

 private:
  std::function<Page()> page_;
};

Monitor::Monitor() = default;
Monitor::~Monitor() = default;

absl::StatusOr<std::unique_ptr<Monitor>> Monitor::open(const std::string& address, Monitored monitored) {
  // CivetWeb would also accept a list of addresses.
  if (!parse_listen_address(address) || address.find(',') != std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", address, "' is not a valid address for metrics: use host:port"));
  }
  std::unique_ptr<Monitor> monitor(new Monitor());
  try {
    monitor->server_ = std::make_unique<CivetServer>(std::vector<std::string>{
        "listening_ports", address, "num_threads", kThreads, "request_timeout_ms", kPatienceMs});
  } catch (const CivetException&) {
    return absl::UnavailableError(absl::StrCat("cannot serve metrics on ", address,
                                               ": the address is in use or does not belong to this machine"));
  }
  const auto serve = [&](const char* path, std::function<Page()> page) {
    monitor->handlers_.push_back(std::make_unique<Handler>(std::move(page)));
    monitor->server_->addHandler(path, *monitor->handlers_.back());
  };
  serve("/healthz$", [alive = monitored.alive] { return page_of(alive()); });
  serve("/readyz$", [ready = monitored.ready] { return page_of(ready()); });
  serve("/metrics$", [monitored = std::move(monitored)] { return metrics_page(monitored); });
  monitor->address_ = with_port(address, monitor->server_->getListeningPorts().front());
  return monitor;
}

}  // namespace tessera
