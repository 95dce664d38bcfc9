#include "embedded/embedded_cluster.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "coordinator/client_edge.h"
#include "coordinator/request_queue.h"
#include "daemon/address.h"
#include "embedded/stream_service.h"
#include "lpss/base/invariant.h"
#include "lpss/engine/load_engine.h"
#include "tiles/tile_folder.h"

namespace tessera {
namespace {

constexpr NodeId kFirstServer{2};

// How much time may pass where nothing is done, before a request counts as one that nobody answers.
constexpr std::chrono::seconds kIdleMax{60};
// The most time that a running world makes up for.
constexpr std::chrono::seconds kElapsedMax{1};
// How often a call that waits asks whether it is to end.
constexpr std::chrono::milliseconds kLookEvery{20};

v1::ClusterMessage parsed(const std::string& payload) {
  v1::ClusterMessage message;
  invariant(message.ParseFromString(payload), "processes of one cluster send valid messages");
  return message;
}

CoordinatorOptions coordinator_options(const EmbeddedClusterOptions& given) {
  CoordinatorOptions options;
  options.servers_wanted = given.servers;
  options.log = given.log;
  return options;
}

}  // namespace

// The state machines, their mail and their time.
class EmbeddedCluster::Processes {
 public:
  // `wake`: that a stream begins.
  Processes(const EmbeddedClusterOptions& options, std::function<void()> wake)
      : options_(options), wake_(std::move(wake)), coordinator_(coordinator_options(options)) {
    for (std::uint32_t n = 0; n < options.servers; ++n) start_server();
  }

  // Whether anything was done.
  bool take_turn(std::vector<ClientRequest> requests) {
    if (!requests.empty()) replace_ended_servers();
    const bool has_coordinator_worked = run_coordinator(std::move(requests));
    bool has_server_worked = false;
    for (Server& server : servers_) has_server_worked |= run_server(server);
    return has_coordinator_worked || has_server_worked;
  }

  StreamService& streams() { return streams_; }

  // Shows a world that is paused to streams that are new.
  void publish() {
    for (Server& server : servers_) {
      TickMachine* const machine = server.machine->machine_between_ticks();
      if (machine != nullptr) server.streams->publish(server.machine->tick(), *machine, true);
    }
  }

  void pass_time(Nanoseconds elapsed) { now_ += elapsed; }

  // How long it is until something is to be done, if nothing comes.
  std::optional<Nanoseconds> until_deadline() const {
    std::optional<Nanoseconds> first = coordinator_.next_deadline();
    for (const Server& server : servers_) {
      const std::optional<Nanoseconds> next = server.machine->next_deadline();
      if (next && (!first || *next < *first)) first = next;
    }
    if (!first) return std::nullopt;
    return std::max(*first - now_, Nanoseconds(1));
  }

 private:
  struct Mail {
    NodeId from;
    v1::ClusterMessage message;
  };
  struct Server {
    NodeId node;
    std::shared_ptr<Streams> streams;
    std::unique_ptr<SectorServer> machine;
    std::vector<Mail> mail;
  };

  // For whoever asks next: a server that could not go on with a world may have another one.
  void replace_ended_servers() {
    const std::size_t before = servers_.size();
    std::erase_if(servers_, [](const Server& server) { return server.machine->finished().has_value(); });
    for (std::size_t n = servers_.size(); n < before; ++n) start_server();
  }

  void start_server() {
    Server& server = servers_.emplace_back();
    server.node = next_node_;
    ++next_node_.value;
    SectorServerOptions options;
    options.precision = options_.precision;
    options.threads = options_.threads;
    options.stream_address = absl::StrCat("embedded-", server.node.value);
    options.log = options_.log;
    Streams& streams = *(server.streams = std::make_shared<Streams>(server.node, wake_));
    streams_.add(server.node, server.streams);
    options.on_load = [&streams](const v1::LoadWorld& load) { streams.begin_world(load); };
    options.on_new_servers = [&streams](const NewServers& servers) { streams.change_servers(servers); };
    options.on_left = [&streams] { streams.end_world(); };
    options.changed_subscriptions = [&streams] { return streams.changed_subscriptions(); };
    server.machine = std::make_unique<SectorServer>(
        options, load_engine, [] { return Clock::now().time_since_epoch(); },
        [&streams](Tick tick, TickMachine& machine) { streams.publish(tick, machine, false); });
    server.machine->start(server.node, now_);
  }

  bool run_coordinator(std::vector<ClientRequest> requests) {
    bool has_worked = !requests.empty() || !mail_.empty();
    auto next = requests.begin();
    const auto take = [&]() -> std::optional<ClientRequest> {
      if (next == requests.end()) return std::nullopt;
      return std::move(*next++);
    };
    if (!requests.empty()) coordinator_.handle(take, now_);
    for (Mail& mail : std::exchange(mail_, {}))
      coordinator_.receive(mail.from, std::move(mail.message), now_);
    coordinator_.advance(now_);
    for (OutgoingMessage& out : coordinator_.take_messages()) {
      has_worked = true;
      if (Server* server = find(out.to)) server->mail.push_back({kCoordinatorNode, std::move(out.message)});
    }
    return has_worked;
  }

  bool run_server(Server& server) {
    SectorServer& machine = *server.machine;
    bool has_worked = !server.mail.empty();
    for (Mail& mail : std::exchange(server.mail, {}))
      machine.receive(mail.from, std::move(mail.message), now_);
    machine.advance(now_);
    if (machine.work_left()) {
      machine.proceed(now_);
      has_worked = true;
    }
    for (const SectorServer::Outgoing& out : machine.take_messages()) {
      has_worked = true;
      if (out.to == kCoordinatorNode) {
        mail_.push_back({server.node, parsed(out.payload)});
      } else if (Server* to = find(out.to)) {
        to->mail.push_back({server.node, parsed(out.payload)});
      }
    }
    if (machine.finished()) coordinator_.ended(server.node, now_);
    return has_worked;
  }

  Server* find(NodeId node) {
    const auto found = std::ranges::find(servers_, node, &Server::node);
    return found == servers_.end() ? nullptr : &*found;
  }

  const EmbeddedClusterOptions options_;
  const std::function<void()> wake_;
  StreamService streams_;
  Nanoseconds now_{0};
  Coordinator coordinator_;
  std::vector<Mail> mail_;  // of the coordinator
  std::vector<Server> servers_;
  NodeId next_node_ = kFirstServer;
};

// Streams are at the address of the door, as at that of a gateway.
void show_door(ClientRequest& request) {
  auto* const call = std::get_if<ClientCall<v1::StatusRequest, v1::StatusReply>>(&request);
  if (call == nullptr) return;
  call->reply = [reply = std::move(call->reply)](const absl::Status& status, v1::StatusReply answer) {
    answer.set_through_gateway(true);
    reply(status, answer);
  };
}

// Where clients of other processes come in.
class EmbeddedCluster::Door {
 public:
  explicit Door(std::function<void()> wake) : queue_(std::move(wake)) {}

  absl::Status open(const std::string& listen, StreamService& streams) {
    absl::StatusOr<std::unique_ptr<ClientEdge>> edge =
        ClientEdge::open(listen, /*keys=*/std::nullopt, queue_, &streams);
    if (!edge.ok()) return edge.status();
    edge_ = *std::move(edge);
    return absl::OkStatus();
  }

  const std::string& address() const { return edge_->address(); }

  std::vector<ClientRequest> take_requests() { return queue_.take(); }

  void close() {
    queue_.close();
    for (ClientRequest& request : queue_.take()) {
      std::visit([](auto& call) { call.reply(absl::UnavailableError("the simulation was closed"), {}); },
                 request);
    }
    edge_->close();
  }

 private:
  RequestQueue queue_;
  std::unique_ptr<ClientEdge> edge_;
};

EmbeddedCluster::EmbeddedCluster(const EmbeddedClusterOptions& options) {
  use_tile_folders();
  processes_ = std::make_unique<Processes>(options, [this] { wake(); });
}

EmbeddedCluster::~EmbeddedCluster() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    changed_.notify_all();
  }
  if (runner_.joinable()) runner_.join();
  processes_->streams().shut_down();
  if (door_) door_->close();
}

absl::StatusOr<std::string> EmbeddedCluster::serve(const std::string& listen) {
  const std::optional<ListenAddress> address = parse_listen_address(listen);
  if (address && !is_loopback(*address)) {
    return absl::FailedPreconditionError(absl::StrCat("without keys, whoever reaches ", listen,
                                                      " would control the world: it must be of loopback"));
  }
  {
    const std::lock_guard working(working_);
    const std::lock_guard lock(mutex_);
    if (door_) return door_->address();
    auto door = std::make_unique<Door>([this] { wake(); });
    if (absl::Status status = door->open(listen, processes_->streams()); !status.ok()) return status;
    door_ = std::move(door);
    changed_.notify_all();
  }
  keep_running();
  const std::lock_guard lock(mutex_);
  return door_->address();
}

void EmbeddedCluster::wake() {
  const std::lock_guard lock(mutex_);
  is_woken_ = true;
  changed_.notify_all();
}

void EmbeddedCluster::post(ClientRequest request) {
  const std::lock_guard lock(mutex_);
  requests_.push_back(std::move(request));
  changed_.notify_all();
}

std::vector<ClientRequest> EmbeddedCluster::take_requests() {
  const std::lock_guard lock(mutex_);
  is_woken_ = false;
  std::vector<ClientRequest> requests = std::exchange(requests_, {});
  if (!door_) return requests;
  for (ClientRequest& request : door_->take_requests()) requests.push_back(std::move(request));
  for (ClientRequest& request : requests) show_door(request);
  return requests;
}

bool EmbeddedCluster::take_turn() { return processes_->take_turn(take_requests()); }

absl::Status EmbeddedCluster::work_until(const std::function<bool()>& is_answered,
                                         std::optional<Nanoseconds> timeout,
                                         const IsInterrupted& is_interrupted) {
  const Clock::time_point began = Clock::now();
  Clock::time_point looked = began;
  Nanoseconds idle{0};
  while (true) {
    bool has_runner;
    {
      std::unique_lock lock(mutex_);
      if (has_runner = is_self_driven(); has_runner) {
        changed_.wait_for(lock, kLookEvery, [&] { return is_answered() || !is_self_driven(); });
      }
      if (is_answered()) return absl::OkStatus();
    }
    if (!has_runner) {
      const std::lock_guard working(working_);
      if (!take_turn()) {
        const std::optional<Nanoseconds> wait = processes_->until_deadline();
        if (!wait || idle > kIdleMax) return absl::InternalError("the request has no answer");
        processes_->pass_time(*wait);
        idle += *wait;
      }
    }
    const Clock::time_point now = Clock::now();
    if (timeout && now - began >= *timeout) {
      return absl::DeadlineExceededError(
          absl::StrCat("no answer within ", std::chrono::duration<double>(*timeout).count(), " s"));
    }
    if (!is_interrupted || now - looked < kLookEvery) continue;
    looked = now;
    if (is_interrupted()) return absl::CancelledError("interrupted");
  }
}

void EmbeddedCluster::keep_running() {
  const std::lock_guard lock(mutex_);
  if (is_self_driven() && !runner_.joinable()) runner_ = std::thread([this] { run(); });
}

void EmbeddedCluster::run() {
  Clock::time_point last = Clock::now();
  std::unique_lock lock(mutex_);
  while (!is_ending_) {
    if (!is_self_driven()) {
      changed_.wait(lock, [&] { return is_ending_ || is_self_driven(); });
      last = Clock::now();
      continue;
    }
    lock.unlock();
    const Clock::time_point now = Clock::now();
    std::optional<Nanoseconds> wait;
    {
      const std::lock_guard working(working_);
      processes_->pass_time(std::min<Nanoseconds>(now - last, kElapsedMax));
      if (!take_turn()) wait = processes_->until_deadline().value_or(kElapsedMax);
      processes_->publish();
    }
    last = now;
    lock.lock();
    if (!wait) continue;
    changed_.wait_for(lock, *wait,
                      [&] { return is_ending_ || !is_self_driven() || is_woken_ || !requests_.empty(); });
  }
}

}  // namespace tessera
