// How a cluster is: status, top.
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <utility>

#include "cli/child_process.h"
#include "cli/cluster_load.h"
#include "cli/connection.h"
#include "cli/interrupt.h"
#include "cli/screen.h"
#include "cli/status_text.h"
#include "cli/terminal.h"
#include "cli/text.h"
#include "client_sdk/arguments/parse.h"
#include "client_sdk/src/status_json.h"

namespace tessera::cli {
namespace {

constexpr absl::Duration kRedrawEvery = absl::Milliseconds(500);
constexpr absl::Duration kLookTimeout = absl::Seconds(5);
constexpr absl::Duration kPatience = absl::Milliseconds(250);  // so that Ctrl-C is noticed
constexpr double kPeriodMin = 0.1;                             // s
constexpr double kPeriodMax = 3600;                            // s

std::string to_text(const ClusterStatus& status) {
  std::vector<std::vector<std::string>> rows = {{"server", "streams", "engine", "threads", "tick", "bodies",
                                                 "sectors", "awake", "clones", "p50 ms", "p99 ms", "own ms",
                                                 "sent", "memory"}};
  for (const ServerStatus& server : status.servers) {
    rows.push_back({label(server), server.stream_address, name_of(server.precision),
                    absl::StrCat(server.threads), grouped(server.tick), grouped(server.bodies),
                    grouped(server.counts.sectors), grouped(server.counts.sectors_awake),
                    grouped(server.counts.clones), absl::StrFormat("%.2f", server.tick_ms.p50),
                    absl::StrFormat("%.2f", server.tick_ms.p99), absl::StrFormat("%.2f", server.own_ms),
                    megabytes(static_cast<double>(server.exchange_bytes)),
                    megabytes(static_cast<double>(server.peak_rss_bytes))});
  }
  std::vector<bool> right(rows.front().size(), true);
  right[0] = right[1] = false;
  if (std::ranges::any_of(status.servers,
                          [](const ServerStatus& server) { return !server.labels.empty(); })) {
    rows.front().emplace_back("labels");
    for (std::size_t n = 0; n < status.servers.size(); ++n)
      rows[n + 1].push_back(absl::StrJoin(status.servers[n].labels, ","));
    right.push_back(false);
  }
  return absl::StrCat(summary(status), "\n", table(rows, right));
}

absl::Status show_status(Client& client, bool live, nlohmann::json& data) {
  if (live) catch_interrupts();
  Screen screen(live);
  do {
    const absl::StatusOr<ClusterStatus> status = client.status();
    if (!status.ok()) return status.status();
    screen.draw(to_text(*status));
    data = tessera::to_json(*status);
  } while (live && !wait_readable({interrupt_descriptor()}, kRedrawEvery));
  return absl::OkStatus();
}

void add_status(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "status", "Show the state of the cluster.", "tessera status --watch");
  const auto live = std::make_shared<bool>(false);
  command.add_flag("--watch", *live, "again and again, until Ctrl-C");
  on_cluster(command, action,
             [live](Client& client, nlohmann::json& data) { return show_status(client, *live, data); });
}

struct TopOptions {
  std::string by;
  std::string sort = kSortDefault;
  double period = 1;  // s
  bool once = false;
};

absl::StatusOr<double> parse_period(const std::string& text) {
  absl::StatusOr<double> seconds = parse_seconds(text);
  if (seconds.ok() && (*seconds < kPeriodMin || *seconds > kPeriodMax)) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\" is not from ", kPeriodMin, " s to ", kPeriodMax, " s"));
  }
  return seconds;
}

// One tick of it.
template <typename Frame>
absl::StatusOr<Frame> sampled(absl::StatusOr<std::unique_ptr<Stream<Frame>>> stream) {
  if (!stream.ok()) return stream.status();
  const absl::Time deadline = absl::Now() + kLookTimeout;
  for (;;) {
    absl::StatusOr<Frame> frame = (*stream)->next(kPatience);
    const bool is_awaited = absl::IsDeadlineExceeded(frame.status()) && absl::Now() < deadline;
    if (!is_awaited || interrupted()) return frame;
  }
}

absl::StatusOr<std::vector<SectorLoad>> sectors_of(Client& client, const ClusterStatus& status) {
  if (status.state != "paused" && status.state != "running") return std::vector<SectorLoad>();
  const absl::StatusOr<BodyFrame> bodies = sampled(client.watch_bodies({}, kLookTimeout));
  if (!bodies.ok()) return bodies.status();
  const absl::StatusOr<SeamFrame> seams = sampled(client.watch_seams({}, kLookTimeout));
  if (!seams.ok()) return seams.status();
  return sector_loads(*bodies, *seams);
}

absl::Status show_load(Client& client, const TopOptions& options, nlohmann::json& data) {
  if (!options.once) catch_interrupts();
  const LoadTables tables = {.servers = options.by != "sector", .sectors = options.by != "server"};
  Screen screen(!options.once);
  do {
    absl::StatusOr<ClusterStatus> status = client.status();
    if (!status.ok()) return status.status();
    absl::StatusOr<std::vector<SectorLoad>> sectors = sectors_of(client, *status);
    if (interrupted()) break;
    // Whoever goes on looking learns more the next time.
    if (options.once && !sectors.ok()) return sectors.status();
    ClusterLoad load = cluster_load(*std::move(status), std::move(sectors));
    sort_by(options.sort, load);
    screen.draw(to_text(load, tables, screen.lines()));
    data = to_json(load);
  } while (!options.once && !wait_readable({interrupt_descriptor()}, absl::Seconds(options.period)));
  return absl::OkStatus();
}

void add_top(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "top", "Show the load of servers and sectors, busiest first, until Ctrl-C.",
                  "tessera top --sort clones\n  tessera top --by sector --once");
  const auto options = std::make_shared<TopOptions>();
  command.add_option("--by", options->by, "only this table: server or sector")
      ->check(CLI::IsMember({"server", "sector"}));
  command
      .add_option("--sort", options->sort,
                  absl::StrCat("column whose largest come first; a table that has none of this name stays "
                               "sorted by bodies awake: ",
                               absl::StrJoin(sort_columns(), ", ")))
      ->check(CLI::IsMember(sort_columns()).description(""))
      ->capture_default_str();
  add_parsed(command, "--period", options->period, parse_period,
             "time between two looks, each of which asks for the states of all bodies; 1s if not given");
  command.add_flag("--once", options->once, "look once, then end");
  on_cluster(command, action,
             [options](Client& client, nlohmann::json& data) { return show_load(client, *options, data); });
}

}  // namespace

void add_status_commands(CLI::App& app, Action& action) {
  add_status(app, action);
  add_top(app, action);
}

}  // namespace tessera::cli
