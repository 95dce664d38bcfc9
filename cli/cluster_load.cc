#include "cli/cluster_load.h"

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "cli/status_text.h"
#include "cli/terminal.h"
#include "cli/text.h"
#include "client_sdk/src/status_json.h"

namespace tessera::cli {
namespace {

template <typename Load>
struct Column {
  const char* name;
  double (*amount)(const Load&);
  std::string (*text)(double amount);
};

template <auto kMember, typename Load>
double amount(const Load& load) {
  return static_cast<double>(load.*kMember);
}

template <std::uint64_t TickCounts::*kMember>
double counted(const ServerLoad& server) {
  return static_cast<double>(server.counts.*kMember);
}

template <double TickTimes::*kMember>
double time(const ServerLoad& server) {
  return server.tick_ms.*kMember;
}

std::string count(double amount) { return grouped(static_cast<std::uint64_t>(amount)); }
std::string milliseconds(double amount) { return absl::StrFormat("%.2f ms", amount); }

constexpr Column<ServerLoad> kServerColumns[] = {
    {"awake", amount<&ServerLoad::awake>, count},
    {"bodies", amount<&ServerLoad::bodies>, count},
    {"clones", counted<&TickCounts::clones>, count},
    {"sectors", counted<&TickCounts::sectors>, count},
    {"p50", time<&TickTimes::p50>, milliseconds},
    {"p99", time<&TickTimes::p99>, milliseconds},
    {"sent", amount<&ServerLoad::exchange_bytes>, megabytes},
    {"memory", amount<&ServerLoad::peak_rss_bytes>, megabytes},
};

constexpr Column<SectorLoad> kSectorColumns[] = {
    {"awake", amount<&SectorLoad::awake>, count},
    {"bodies", amount<&SectorLoad::bodies>, count},
    {"clones", amount<&SectorLoad::clones>, count},
};

std::string hexadecimal(std::uint64_t node) { return absl::StrCat(absl::Hex(node)); }

std::vector<std::string> names(const ServerLoad& server) { return {label(server)}; }
std::vector<std::string> names(const SectorLoad& sector) {
  return {to_string(sector.sector), hexadecimal(sector.server)};
}

template <typename Load, std::size_t kColumns>
void sort_each(const Column<Load> (&columns)[kColumns], absl::string_view name, std::vector<Load>& loads) {
  for (const Column<Load>& column : columns) {
    if (column.name != name) continue;
    std::stable_sort(loads.begin(), loads.end(),
                     [&](const Load& a, const Load& b) { return column.amount(a) > column.amount(b); });
  }
}

// The first `shown` of them, and how many `things` there are beyond.
template <typename Load, std::size_t kColumns>
std::string to_table(std::vector<std::string> titles, const Column<Load> (&columns)[kColumns],
                     const std::vector<Load>& loads, std::size_t shown, absl::string_view things) {
  std::vector<bool> right(titles.size(), false);
  right.resize(titles.size() + kColumns, true);
  for (const Column<Load>& column : columns) titles.emplace_back(column.name);
  std::vector<std::vector<std::string>> rows = {std::move(titles)};
  shown = std::min(shown, loads.size());
  for (std::size_t place = 0; place < shown; ++place) {
    rows.push_back(names(loads[place]));
    for (const Column<Load>& column : columns)
      rows.back().push_back(column.text(column.amount(loads[place])));
  }
  std::string text = table(rows, right);
  if (shown < loads.size()) absl::StrAppend(&text, "and ", grouped(loads.size() - shown), " ", things, "\n");
  return text;
}

// How many rows of two tables are shown where there is room for so many: each has half, and what the other
// one leaves.
std::pair<std::size_t, std::size_t> shared_out(std::size_t room, std::size_t first, std::size_t second) {
  const std::size_t shown = std::min(first, std::max(room / 2, room - std::min(room, second)));
  return {shown, std::min(second, room - shown)};
}

}  // namespace

std::vector<SectorLoad> sector_loads(const BodyFrame& bodies, const SeamFrame& seams) {
  absl::btree_map<SectorIndex, SectorLoad> sectors;
  for (const BodySample& body : bodies.bodies) {
    SectorLoad& sector = sectors[body.pose.position.sector];
    sector.server = body.server;
    ++sector.bodies;
    sector.awake += body.asleep ? 0 : 1;
  }
  for (const CloneSample& clone : seams.clones) {
    SectorLoad& sector = sectors[clone.sector];
    sector.server = clone.server;
    ++sector.clones;
  }
  std::vector<SectorLoad> loads;
  for (auto& [index, sector] : sectors) {
    sector.sector = index;
    loads.push_back(sector);
  }
  return loads;
}

ClusterLoad cluster_load(ClusterStatus status, absl::StatusOr<std::vector<SectorLoad>> sectors) {
  absl::flat_hash_map<std::uint64_t, std::uint64_t> awake;
  if (sectors.ok()) {
    for (const SectorLoad& sector : *sectors) awake[sector.server] += sector.awake;
  }
  std::vector<ServerLoad> servers;
  for (const ServerStatus& server : status.servers) servers.push_back({server, awake[server.node]});
  return {std::move(status), std::move(servers), std::move(sectors)};
}

std::vector<std::string> sort_columns() {
  std::vector<std::string> columns;
  for (const auto& column : kServerColumns) columns.emplace_back(column.name);
  for (const auto& column : kSectorColumns) {
    if (std::find(columns.begin(), columns.end(), column.name) == columns.end())
      columns.emplace_back(column.name);
  }
  return columns;
}

void sort_by(absl::string_view column, ClusterLoad& load) {
  for (const absl::string_view next :
       {absl::string_view("bodies"), absl::string_view(kSortDefault), column}) {
    sort_each(kServerColumns, next, load.servers);
    if (load.sectors.ok()) sort_each(kSectorColumns, next, *load.sectors);
  }
}

std::string to_text(const ClusterLoad& load, const LoadTables& tables, std::optional<std::size_t> lines) {
  std::string text = summary(load.status);
  // Above the rows of a table an empty line and the titles, below them what is left out.
  constexpr std::size_t kAround = 3;
  const std::size_t around = kAround * (std::size_t{tables.servers} + std::size_t{tables.sectors});
  const std::size_t taken = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + around;
  const std::size_t room = lines ? *lines - std::min(*lines, taken) : std::numeric_limits<std::size_t>::max();
  const auto [servers, sectors] = shared_out(room, tables.servers ? load.servers.size() : 0,
                                             tables.sectors && load.sectors.ok() ? load.sectors->size() : 0);
  if (tables.servers) {
    absl::StrAppend(&text, "\n", to_table({"server"}, kServerColumns, load.servers, servers, "more servers"));
  }
  if (tables.sectors && load.sectors.ok()) {
    absl::StrAppend(&text, "\n",
                    to_table({"sector", "server"}, kSectorColumns, *load.sectors, sectors, "more sectors"));
  } else if (tables.sectors) {
    absl::StrAppend(&text, "\n",
                    coloured(absl::StrCat("no sectors: ", load.sectors.status().message()), Colour::kRed),
                    "\n");
  }
  return text;
}

nlohmann::json to_json(const ClusterLoad& load) {
  ClusterStatus status = load.status;
  status.servers.assign(load.servers.begin(), load.servers.end());
  nlohmann::json data = tessera::to_json(status);
  for (std::size_t place = 0; place < load.servers.size(); ++place) {
    data["servers"][place]["bodies_awake"] = load.servers[place].awake;
  }
  data["sectors_by_load"] = nlohmann::json::array();
  if (!load.sectors.ok()) return data;
  for (const SectorLoad& sector : *load.sectors) {
    nlohmann::json& row = data["sectors_by_load"].emplace_back();
    row = {{"sector", {sector.sector.i, sector.sector.j, sector.sector.k}},
           {"server", hexadecimal(sector.server)},
           {"bodies", sector.bodies},
           {"bodies_awake", sector.awake},
           {"clones", sector.clones}};
    if (sector.sector.frame != kWorldFrame) row["frame"] = sector.sector.frame;
  }
  return data;
}

}  // namespace tessera::cli
