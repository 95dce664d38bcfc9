// A cluster and its world: up, load, unload, pause, resume, step, drain, balance, shutdown.
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "cli/connection.h"
#include "cli/interrupt.h"
#include "cli/local_cluster.h"
#include "cli/terminal.h"
#include "cli/text.h"
#include "cli/world_options.h"
#include "coordinator/balance_policy.h"
#include "daemon/parse_command_line.h"
#include "lpss/model/limits.h"

namespace tessera::cli {
namespace {

constexpr const char* kPageDefault = "127.0.0.1:7380";

struct UpOptions {
  LocalClusterOptions cluster;
  std::filesystem::path world;  // empty: none yet
  WorldOverrides overrides;
  bool end_with_input = false;
  bool no_replacement = false;
  double checkpoint_s = 1;
  double balance_s = absl::ToDoubleSeconds(kBalanceEvery);
  bool without_viewer = false;  // the web UI was not asked for, and tessera-viewer is not there
};

absl::Status load_into(const LocalCluster& cluster, const std::filesystem::path& keys,
                       const WorldDescription& world) {
  const absl::StatusOr<std::unique_ptr<Client>> client =
      Client::connect(cluster.address(), kCallTimeout, keys);
  if (!client.ok()) return client.status();
  const absl::StatusOr<LoadSummary> summary = (*client)->load(world);
  if (!summary.ok()) return summary.status();
  absl::PrintF("%s: %s bodies in %s sectors, paused; start it in the web UI or with tessera resume\n",
               world.name, grouped(summary->bodies), grouped(summary->sectors));
  return absl::OkStatus();
}

absl::Status up(UpOptions options) {
  catch_interrupts();
  if (options.end_with_input) interrupt_at_end_of_input();
  std::optional<LoadedWorld> world;
  if (!options.world.empty()) {
    absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
    if (!loaded.ok()) return loaded.status();
    absl::PrintF("%s", file_notes(loaded->notices, loaded->repairs));
    world = *std::move(loaded);
  }
  LocalClusterOptions& wanted = options.cluster;
  if (std::filesystem::exists(options.world)) wanted.looks = std::filesystem::absolute(options.world);
  wanted.interrupt_descriptor = interrupt_descriptor();
  wanted.precision = world
                         ? world->world.settings.precision
                         : options.overrides.knobs.get(&WorldSettings::precision).value_or(wanted.precision);
  const absl::StatusOr<std::unique_ptr<LocalCluster>> cluster = LocalCluster::start(wanted);
  if (!cluster.ok()) return cluster.status();
  absl::PrintF("%s on %s with %d sector server%s; Ctrl-C ends it\n",
               coloured("a cluster is up", Colour::kGreen), (*cluster)->address(), wanted.servers,
               wanted.servers == 1 ? "" : "s");
  for (const std::string& gateway : (*cluster)->gateways())
    absl::PrintF("%s: %s\n", coloured("a gateway, which is enough for clients to reach", Colour::kGreen),
                 gateway);
  if (!(*cluster)->page_url().empty()) {
    absl::PrintF("%s: %s\n", coloured("see it in a browser", Colour::kGreen), (*cluster)->page_url());
  } else if (options.without_viewer) {
    absl::PrintF("without the web UI: in a clone, deploy/build.sh release tessera-viewer builds it\n");
  }
  if (!world) absl::PrintF("try: tessera load worlds/seam.sdf --connect %s\n", (*cluster)->address());
  std::fflush(stdout);
  if (world) {
    const auto load = [&] { return load_into(**cluster, wanted.keys, world->world); };
    if (absl::Status status = (*cluster)->attend(load); !status.ok()) return status;
    std::fflush(stdout);
  }
  return (*cluster)->wait_for_interrupt([](const std::string& what) {
    absl::FPrintF(stderr, "%s: %s\n", coloured("the cluster continues", Colour::kRed), what);
  });
}

void add_up(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "up", "Run a cluster on this machine until Ctrl-C.",
                                  "tessera up worlds/earth.sdf --servers 2 --listen 127.0.0.1:7300");
  const auto options = std::make_shared<UpOptions>();
  LocalClusterOptions& cluster = options->cluster;
  cluster.listen = kAddressDefault;
  cluster.page = kPageDefault;
  cluster.threads = 0;
  command.add_option("world", options->world, absl::StrCat("to load: ", kWorldFile));
  command.add_option("--servers", cluster.servers, "sector servers, each a process")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command
      .add_option("--threads", cluster.threads, "threads of each server; by default the cores, shared out")
      ->check(CLI::Range(1, 256));
  command.add_option("--listen", cluster.listen, "where clients find the coordinator")->capture_default_str();
  command
      .add_option(
          "--gateway", cluster.gateways,
          "also a gateway at this address, or several, separated by commas: clients that reach it need\n"
          "reach no other daemon")
      ->delimiter(',');
  CLI::Option* page = command
                          .add_option("--page", cluster.page,
                                      "address of the web UI; by default, if that is in use, any free port")
                          ->capture_default_str();
  CLI::Option* no_page = command.add_flag("--no-page")->description("without the web UI")->excludes(page);
  command.add_option(
      "--record-inputs", cluster.record_inputs,
      "write worlds, commands and the hash of every tick to this new file, for tessera replay");
  command
      .add_option(
          "--checkpoint-every", options->checkpoint_s,
          "s; the world survives the loss of servers, and repeats at most about this much and half a\n"
          "second; 0: the world ends with any of its servers")
      ->check(number_within(0.0, 1e6))
      ->capture_default_str();
  command
      .add_option("--balance-every", options->balance_s,
                  "s; how often the world is divided anew where its servers have unequal work; 0: never")
      ->check(number_within(0.0, 1e6))
      ->capture_default_str();
  command
      .add_option("--balance-policy", cluster.balance_policy, "how it is divided, as of tessera-coordinator")
      ->check(CLI::IsMember(balance_policy_names()))
      ->capture_default_str();
  command.add_option(
      "--store", cluster.store_folder,
      "keep the world in this folder, and go on with the one that is there; by default it is kept\n"
      "until the cluster ends");
  command
      .add_option(
          "--keys", cluster.keys,
          "folder of `tessera keys create`: clients and browsers must show a certificate or a token of it")
      ->envname("TESSERA_KEYS");
  command.add_flag("--insecure", cluster.insecure,
                   "listen beyond loopback without keys: whoever reaches the addresses controls the world");
  command.add_flag("--no-replacement", options->no_replacement, "end with any daemon");
  command.add_flag("--end-with-input", options->end_with_input,
                   "end when the standard input does: with the program that holds the pipe");
  add_override_options(command, options->overrides);
  command.callback([options, page, no_page, &action] {
    const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    LocalClusterOptions& wanted = options->cluster;
    if (wanted.threads == 0) wanted.threads = std::max(1, cores / wanted.servers);
    options->without_viewer =
        page->count() + no_page->count() == 0 && !std::filesystem::exists(executable_folder() / kViewer);
    if (no_page->count() > 0 || options->without_viewer) wanted.page.clear();
    wanted.page_on_any_port = page->count() == 0;
    wanted.checkpoint_every = absl::Seconds(options->checkpoint_s);
    wanted.balance_every = absl::Seconds(options->balance_s);
    wanted.replaces_daemons = !options->no_replacement && options->checkpoint_s > 0;
    wanted.store = wanted.replaces_daemons;
    action = [options] { return up(*options); };
  });
}

void add_load(CLI::App& app, Action& action) {
  CLI::App& command = add_command(app, "load", "Load a world file, paused at tick 0.",
                                  "tessera load worlds/earth.sdf --replace");
  struct LoadOptions {
    std::filesystem::path world;
    WorldOverrides overrides;
    bool replace = false;
  };
  const auto options = std::make_shared<LoadOptions>();
  command.add_option("world", options->world, kWorldFile)->required();
  command.add_flag("--replace", options->replace, "also where a world is loaded already");
  add_override_options(command, options->overrides);
  on_cluster(command, action, [options](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<LoadedWorld> loaded = load_world(options->world, options->overrides);
    if (!loaded.ok()) return loaded.status();
    const absl::StatusOr<LoadSummary> summary = client.load(loaded->world, options->replace);
    if (!summary.ok()) return summary.status();
    absl::PrintF("%s: %s bodies, %s sectors, on %d server%s\n", loaded->world.name, grouped(summary->bodies),
                 grouped(summary->sectors), summary->servers, summary->servers == 1 ? "" : "s");
    data = {{"world", loaded->world.name}, {"bodies", summary->bodies},  {"sectors", summary->sectors},
            {"servers", summary->servers}, {"notices", loaded->notices}, {"repairs", loaded->repairs}};
    absl::PrintF("%s", file_notes(loaded->notices, loaded->repairs));
    return absl::OkStatus();
  });
}

absl::Status print_tick(absl::string_view what, const absl::StatusOr<Tick>& tick, nlohmann::json& data) {
  if (!tick.ok()) return tick.status();
  data["tick"] = *tick;
  absl::PrintF("%s tick %d\n", what, *tick);
  return absl::OkStatus();
}

void add_time(CLI::App& app, Action& action) {
  CLI::App& pause = add_command(app, "pause", "Pause the simulation.", "tessera pause");
  on_cluster(pause, action, [](Client& client, nlohmann::json& data) {
    return print_tick("paused at", client.pause(), data);
  });

  CLI::App& resume = add_command(app, "resume", "Resume the simulation, in real time or at another pace.",
                                 "tessera resume --rtf 0.5");
  struct Pace {
    double factor = 1;
    bool fast = false;
  };
  const auto pace = std::make_shared<Pace>();
  CLI::Option* factor = resume.add_option("--rtf", pace->factor, "simulated seconds per second")
                            ->check(above_zero())
                            ->capture_default_str();
  resume.add_flag("--fast", pace->fast, "as fast as possible")->excludes(factor);
  on_cluster(resume, action, [pace](Client& client, nlohmann::json& data) {
    return print_tick("runs from", client.resume(pace->fast ? 0 : pace->factor), data);
  });

  CLI::App& step = add_command(app, "step", "Run a number of ticks, and wait for them.", "tessera step 60");
  const auto ticks = std::make_shared<std::uint64_t>(1);
  step.add_option("ticks", *ticks, "how many")->check(above_zero())->capture_default_str();
  on_cluster(step, action, [ticks](Client& client, nlohmann::json& data) {
    return print_tick("at", client.step(*ticks), data);
  });
}

void add_drain(CLI::App& app, Action& action) {
  CLI::App& drain = add_command(
      app, "drain", "Move everything off a sector server, so that it can be stopped without loss.",
      "tessera drain 2");
  const auto node = std::make_shared<std::string>();
  drain
      .add_option("node", *node,
                  "of the server, as tessera status shows it; up to 64: its place there, from 1 on")
      ->required();
  on_cluster(drain, action, [node](Client& client, nlohmann::json& data) -> absl::Status {
    std::uint64_t number = 0;
    if (!absl::SimpleHexAtoi(*node, &number)) {
      return absl::InvalidArgumentError(absl::StrCat("node = ", *node, " must be a hexadecimal number"));
    }
    std::size_t place = 0;
    if (absl::SimpleAtoi(*node, &place) && place <= kServersMax) {
      const absl::StatusOr<ClusterStatus> status = client.status();
      if (!status.ok()) return status.status();
      if (place < 1 || place > status->servers.size()) {
        return absl::InvalidArgumentError(
            absl::StrCat("node = ", place, " must be a place from 1 to ", status->servers.size()));
      }
      number = status->servers[place - 1].node;
    }
    const std::string drained = absl::StrFormat("server %x is drained: it hosts nothing since", number);
    return print_tick(drained, client.drain(number), data);
  });
}

std::string summary(const Balance& balance, bool dry_run) {
  if (balance.moved_sectors == 0) return "nothing moves: no other division has a faster slowest server\n";
  return absl::StrCat(grouped(balance.moved_sectors), " sectors with ", grouped(balance.moved_bodies),
                      " bodies ",
                      dry_run         ? "would change servers\n"
                      : balance.moves ? "change servers with the next tick\n"
                                      : "are not moved now: others are about to be\n");
}

void add_balance(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "balance",
      "Redistribute the world among its servers by load; its state keeps the same bits.\n"
      "A running cluster does so by itself (--balance-every); each call moves a bounded number of sectors.",
      "tessera balance --dry-run");
  const auto dry_run = std::make_shared<bool>(false);
  const auto policy = std::make_shared<std::string>();
  command.add_flag("--dry-run", *dry_run, "only show what it would do");
  command.add_option("--policy", *policy, "how to divide it; by default as the cluster does by itself")
      ->check(CLI::IsMember(balance_policy_names()));
  on_cluster(command, action, [dry_run, policy](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<Balance> balance = client.balance(*dry_run, *policy);
    if (!balance.ok()) return balance.status();
    std::vector<std::vector<std::string>> rows = {{"server", "own ms", "then"}};
    nlohmann::json servers = nlohmann::json::array();
    for (const Balance::Share& share : balance->shares) {
      rows.push_back({absl::StrFormat("%x", share.node), absl::StrFormat("%.3f", share.tick_ms),
                      absl::StrFormat("%.3f", share.tick_ms_then)});
      servers.push_back({{"node", absl::StrFormat("%x", share.node)},
                         {"own_ms", share.tick_ms},
                         {"own_ms_then", share.tick_ms_then}});
    }
    absl::PrintF("%s%s", table(rows, {false, true, true}), summary(*balance, *dry_run));
    data = {{"tick", balance->tick},
            {"servers", servers},
            {"moved_sectors", balance->moved_sectors},
            {"moved_bodies", balance->moved_bodies},
            {"moves", balance->moves}};
    return absl::OkStatus();
  });
}

void add_ends(CLI::App& app, Action& action) {
  CLI::App& unload =
      add_command(app, "unload", "Unload the world; the servers keep running.", "tessera unload");
  on_cluster(unload, action, [](Client& client, nlohmann::json&) { return client.unload(); });
  CLI::App& shutdown =
      add_command(app, "shutdown", "Stop the coordinator and its servers.", "tessera shutdown");
  on_cluster(shutdown, action, [](Client& client, nlohmann::json&) { return client.shutdown(); });
}

}  // namespace

void add_cluster_commands(CLI::App& app, Action& action) {
  add_up(app, action);
  add_load(app, action);
  add_time(app, action);
  add_drain(app, action);
  add_balance(app, action);
  add_ends(app, action);
}

}  // namespace tessera::cli
