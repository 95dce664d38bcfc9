#include "coordinator/options.h"

#include <CLI/CLI.hpp>

#include "coordinator/balance_policy.h"
#include "daemon/options.h"
#include "lpss/model/limits.h"
#include "proto/server_traits.h"

namespace tessera {

void add_options(CLI::App& app, CoordinatorArguments& arguments) {
  CoordinatorOptions& coordinator = arguments.coordinator;
  app.footer("Example: tessera-coordinator --cluster lab --servers 2 --listen 127.0.0.1:7300");
  app.add_option("--listen", arguments.listen, "Address for clients, host:port; port 0: any free port")
      ->capture_default_str();
  app.add_option("--servers", coordinator.servers_wanted,
                 "Load worlds on this many sector servers of their precision; 0: on all")
      ->check(CLI::Range(0u, kServersMax))
      ->capture_default_str();
  add_labels(app, "--require-labels", coordinator.required_labels,
             "Load worlds on those sector servers alone that were started with all these labels");
  add_seconds(app, "--join-timeout", coordinator.join_timeout, "How long a load waits for sector servers, s",
              0, 1e6);
  add_seconds(app, "--server-timeout", coordinator.server_timeout,
              "Silence after which a sector server counts as lost, s", 0.1, 1e6);
  add_seconds(
      app, "--contact-timeout", coordinator.contact_timeout,
      "How long a sector server that the coordinator or another one does not hear may take to come back, s",
      0, 1e6);
  add_seconds(
      app, "--checkpoint-every", coordinator.checkpoint_every,
      "How often a running world's state is taken down, s, so that it survives the loss of servers; 0: "
      "never",
      0, 1e6);
  add_seconds(app, "--balance-every", coordinator.balance_every,
              "How often a running world is divided anew where its servers have unequal work, or goes to one "
              "of them where it is faster there, s; 0: never",
              0, 1e6);
  add_seconds(app, "--balance-ahead", coordinator.balance_ahead,
              "Divide it by the work that there will be in so many seconds, if bodies go on as they do", 0,
              1e3);
  app.add_option(
         "--balance-policy", arguments.balance_policy,
         "How it is divided: curve: into runs of a curve through all sectors; k-means: by the nearest "
         "centre; hulls: into regions that grow; graph: with short borders, by METIS; grid: into equal "
         "boxes, which stay as they are")
      ->check(CLI::IsMember(balance_policy_names()))
      ->capture_default_str();
  add_mebibytes(app, "--queued-mib", arguments.queued_request_bytes_max,
                "Requests of clients that wait for the coordinator, MiB in all; further ones are refused");
  add_mebibytes(app, "--shapes-mib", coordinator.shape_bytes_max,
                "Shapes of a world, MiB in all, beyond which bodies of further shapes are not spawned");
  app.add_option(
         "--observe-share", coordinator.observe_share,
         "Part of the time of the coordinator and of each sector server that queries of all clients of "
         "role observe may take while the world ticks")
      ->check(CLI::Range(kObserveShareMin, 1.0))
      ->capture_default_str();
  add_metrics_option(app, arguments.metrics_address);
  app.add_option(
         "--store", arguments.store,
         "Keep the world in this folder, and go on with the one that is there; needs --checkpoint-every")
      ->capture_default_str();
  app.add_option("--when-store-fails", arguments.when_store_fails,
                 "While the store cannot be written (its disk is full, or fails): wait: the world waits, and "
                 "nothing is lost; go-on: it goes on, and is set back if the coordinator ends meanwhile")
      ->check(CLI::IsMember({kWaitForStore, "go-on"}))
      ->capture_default_str();
  app.add_option(
         "--etcd", arguments.etcd,
         "URLs of an etcd by which several coordinators agree: one leads, the others stand by; needs --store")
      ->delimiter(',')
      ->default_str("");
  app.add_option("--etcd-ca", arguments.etcd_files.authority,
                 "PEM file with the authority that signs the certificates of an https etcd; without it and a "
                 "certificate: that of --keys, or those that this machine trusts")
      ->capture_default_str();
  app.add_option("--etcd-certificate", arguments.etcd_files.certificate,
                 "PEM file with the certificate that coordinators show to an https etcd; without it and an "
                 "authority: that of --keys, if any")
      ->capture_default_str();
  app.add_option("--etcd-key", arguments.etcd_files.key, "PEM file with the key of that certificate")
      ->capture_default_str();
  add_seconds(app, "--leader-lease", arguments.leader_lease,
              "With --etcd: how long the coordinator that leads may be silent, in whole seconds", 2, 600);
  app.add_option("--record-inputs", arguments.record_inputs,
                 "Record worlds, commands and the hash of every tick to this new file, for tessera replay")
      ->capture_default_str();
  app.add_option("--ready-file", arguments.ready_file,
                 "Write the address for clients to this file once it accepts connections")
      ->configurable(false);
  add_parent_option(app, arguments.exit_with_parent);
  add_shared_options(app, arguments.dds, arguments.log, arguments.keys);
}

std::optional<int> read_arguments(int argc, char** argv, CoordinatorArguments& arguments) {
  CLI::App app("Coordinates the sector servers of a cluster, and serves its clients.", kCoordinatorName);
  add_options(app, arguments);
  return parse_arguments(app, argc, argv);
}

}  // namespace tessera
