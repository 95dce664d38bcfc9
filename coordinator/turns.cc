#include "coordinator/turns.h"

#include <absl/strings/str_cat.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "coordinator/elector.h"
#include "coordinator/etcd_store.h"
#include "coordinator/grpc_etcd.h"
#include "coordinator/process.h"
#include "coordinator/server_watch.h"
#include "coordinator/state_copies.h"
#include "coordinator/state_folder.h"
#include "daemon/address.h"
#include "daemon/log.h"
#include "keys/keys_folder.h"
#include "proto/status.h"

namespace tessera {
namespace {

// The numbers of worlds grow from leader to leader, and are above those that a clock gives.
constexpr std::uint64_t kWorldsByEpoch = std::uint64_t{1} << 62;
constexpr int kWorldsOfEpochBits = 20;

class Turns {
 public:
  Turns(CoordinatorArguments& arguments, Etcd& etcd, StateFolder& folder, StateCopies& copies,
        const ClientKeys& keys, CoordinatorProcess& process)
      : arguments_(arguments),
        etcd_(etcd),
        folder_(folder),
        copies_(copies),
        keys_(keys),
        process_(process),
        elector_(etcd, EtcdKeys(arguments.dds.cluster),
                 {.name = folder.coordinator(),
                  .address = process.address(),
                  .lease = std::chrono::duration_cast<std::chrono::seconds>(arguments.leader_lease),
                  .holds = [&folder](const v1::StateRecord& state) { return folder.holds(state.name()); }},
                 [&process] { process.wake(); }) {}

  int run() {
    for (;;) {
      if (!stand_by()) return 0;
      if (const std::optional<int> code = lead()) return *code;
      elector_.stand_by();
    }
  }

 private:
  // Until this one leads; false where it is to end.
  bool stand_by() {
    StateFollower follower(folder_, keys_);
    ServerWatch watch([this] { process_.wake(); });
    std::string said;
    while (!process_.is_to_end()) {
      const Elector::View view = elector_.view();
      if (view.role == Election::Role::kLeads) return true;
      if (view.role == Election::Role::kLost) elector_.stand_by();
      if (view.cluster_has_ended) {
        log_info("the cluster has ended");
        return false;
      }
      const std::string text = situation(view);
      if (text != said) log_info(text);
      said = text;
      follower.follow(view.leader ? view.leader->address() : std::string());
      std::map<NodeId, std::string> leaders;
      if (view.leader)
        leaders[NodeId{static_cast<std::uint64_t>(view.leader_epoch)}] = view.leader->address();
      watch.follow(leaders);
      if (!watch.take_ended().empty()) elector_.leader_has_ended();
      if (view.state && folder_.holds(view.state->name())) folder_.drop_before(view.state->name());
      process_.refuse_clients(stands_by_error(text));
      process_.wait();
    }
    return false;
  }

  std::string situation(const Elector::View& view) const {
    if (!view.trouble.ok()) return absl::StrCat("this coordinator stands by: ", view.trouble.message());
    if (view.leader)
      return absl::StrCat("this coordinator stands by for the one at ", view.leader->address(),
                          ", which leads");
    if (view.state && !folder_.holds(view.state->name())) {
      std::string holders;
      for (const std::string& holder : view.state->holders())
        absl::StrAppend(&holders, holders.empty() ? "" : ", ", holder);
      return absl::StrCat("this coordinator stands by, and none leads: the state of the world is with ",
                          holders, ", one of which must come back (this one is ", folder_.coordinator(), ")");
    }
    return "this coordinator stands by, and none leads";
  }

  // Until another one does; the exit code where this one is to end.
  std::optional<int> lead() {
    const std::int64_t epoch = elector_.view().epoch;
    log_info(absl::StrCat("this coordinator leads (epoch ", epoch, ")"));
    copies_.lead(true);
    std::optional<int> code = lead_as(epoch);
    copies_.lead(false);
    return code;
  }

  std::optional<int> lead_as(std::int64_t epoch) {
    absl::StatusOr<std::unique_ptr<EtcdStore>> store =
        EtcdStore::open(etcd_, EtcdKeys(arguments_.dds.cluster), folder_, store_options(epoch));
    if (!store.ok()) return give_up(store.status());
    absl::StatusOr<std::unique_ptr<DdsLink>> link = DdsLink::create(arguments_.dds);
    if (!link.ok()) return give_up(link.status());
    CoordinatorOptions options = arguments_.coordinator;
    options.work_clock = steady_time;
    options.log = write_log;
    options.worlds_before = kWorldsByEpoch + (static_cast<std::uint64_t>(epoch) << kWorldsOfEpochBits);
    options.worlds_max = options.worlds_before + (std::uint64_t{1} << kWorldsOfEpochBits) - 1;
    options.store = store->get();
    Coordinator coordinator(options);
    if (absl::Status status = coordinator.resume_stored(); !status.ok()) return give_up(status);
    const bool has_finished =
        process_.serve(coordinator, **link, [&] { return !(*store)->lost() && elector_.leads(); });
    if (!has_finished) {
      log_warning("this coordinator does not lead any more");
      return std::nullopt;
    }
    elector_.resign(/*ends_cluster=*/!process_.is_to_end());
    return 0;
  }

  EtcdStore::Options store_options(std::int64_t epoch) {
    return {.epoch = epoch,
            .leads = [this] { return elector_.leads(); },
            .copies = {[this](std::string recorded, std::string next) {
                         copies_.offer(std::move(recorded), std::move(next));
                       },
                       [this](const std::string& name) { return copies_.holders(name); }},
            .warn = [](const std::string& text) { log_warning(text); }};
  }

  // Others may lead where this one cannot. It stands by again where it has lost what it would need, which
  // another may have.
  std::optional<int> give_up(const absl::Status& status) {
    log_error(absl::StrCat("this coordinator cannot lead: ", status.message()));
    elector_.resign(/*ends_cluster=*/false);
    const std::optional<v1::StateRecord> state = elector_.view().state;
    const bool may_stand_by = absl::IsAborted(status) || (state && !folder_.holds(state->name()));
    return may_stand_by ? std::nullopt : std::optional<int>(1);
  }

  CoordinatorArguments& arguments_;
  Etcd& etcd_;
  StateFolder& folder_;
  StateCopies& copies_;
  const ClientKeys& keys_;  // by which it is admitted by others
  CoordinatorProcess& process_;
  Elector elector_;
};

absl::Status check(const CoordinatorArguments& arguments) {
  if (arguments.store.empty()) return absl::InvalidArgumentError("--etcd needs --store");
  if (arguments.coordinator.checkpoint_every == Nanoseconds::zero())
    return absl::InvalidArgumentError("--etcd needs --checkpoint-every above 0");
  if (arguments.when_store_fails != kWaitForStore)
    return absl::InvalidArgumentError(
        "--when-store-fails go-on does not go with --etcd, for which worlds wait");
  const std::optional<ListenAddress> listen = parse_listen_address(arguments.listen);
  if (listen && (listen->host == "0.0.0.0" || listen->host == "::"))
    return absl::InvalidArgumentError(
        absl::StrCat("--listen ", arguments.listen,
                     ": with --etcd, it must be an address at which other coordinators find this one"));
  if (!arguments.record_inputs.empty())
    return absl::InvalidArgumentError(
        "--record-inputs does not go with --etcd: a recording ends with the coordinator that writes it");
  return absl::OkStatus();
}

// What would keep this one from leading is better known now.
absl::Status check_bus(DdsOptions dds) {
  dds.self = NodeId{~std::uint64_t{0}};
  return DdsLink::create(dds).status();
}

}  // namespace

int take_turns(CoordinatorArguments& arguments) {
  CoordinatorProcess process(arguments);
  const auto fails = [](const absl::Status& status) {
    log_error(status.message());
    return 1;
  };
  if (absl::Status status = check(arguments); !status.ok()) return fails(status);
  const absl::StatusOr<std::optional<ServerKeys>> keys = lock_doors(arguments);
  if (!keys.ok()) return fails(keys.status());
  if (absl::Status status = check_bus(arguments.dds); !status.ok()) return fails(status);
  const absl::StatusOr<ClientKeys> shown = ClientKeys::read(*keys ? (*keys)->folder : "");
  if (!shown.ok()) return fails(shown.status());
  const absl::StatusOr<EtcdAccess> access = etcd_access(arguments, *keys);
  if (!access.ok()) return fails(access.status());
  const std::unique_ptr<Etcd> etcd = connect_etcd(*access, [&process] { process.wake(); });
  absl::StatusOr<std::unique_ptr<StateFolder>> folder = StateFolder::open(arguments.store);
  if (!folder.ok()) return fails(folder.status());
  StateCopies copies(**folder, [&process] { process.wake(); });
  if (absl::Status status = process.open(*keys, &copies); !status.ok()) return fails(status);
  if (absl::Status status = process.say_ready(); !status.ok()) return fails(status);
  const int code = Turns(arguments, *etcd, **folder, copies, *shown, process).run();
  process.close();
  return code;
}

}  // namespace tessera
