// How each kind of fault hits a simulated cluster.
#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "simulator/simulated_cluster.h"

namespace tessera {
namespace {

// A coordinator that is to end while it uses its disk, and does not use it, ends after this.
constexpr std::uint64_t kDyingNs = 1'000'000'000;
constexpr std::uint64_t kDayMs = 86'400'000;

}  // namespace

std::vector<NodeId> SimulatedCluster::living_servers() const {
  std::vector<NodeId> nodes;
  for (const Server& server : servers_) {
    if (server.machine) nodes.push_back(server.node);
  }
  return nodes;
}

std::vector<NodeId> SimulatedCluster::living() const {
  std::vector<NodeId> nodes = living_servers();
  if (coordinator_) nodes.push_back(kCoordinatorNode);
  return nodes;
}

SimulatedCluster::Server* SimulatedCluster::find(NodeId node) {
  const auto place = std::find_if(servers_.begin(), servers_.end(),
                                  [node](const Server& server) { return server.node == node; });
  return place == servers_.end() ? nullptr : &*place;
}

void SimulatedCluster::meet(const FaultSchedule& faults) {
  const std::uint64_t start_ns = network_.now_ns();
  for (const Fault& fault : faults) {
    plan(start_ns + fault.begin_ns, [this, fault, end_ns = start_ns + fault.end_ns] {
      if (begin(fault, end_ns)) ++fault_counts_[static_cast<std::size_t>(fault.kind)];
    });
  }
}

// Whether it hits anything.
bool SimulatedCluster::begin(const Fault& fault, std::uint64_t end_ns) {
  const std::uint64_t length_ns = fault.end_ns - fault.begin_ns;
  const auto pick = [&](const std::vector<NodeId>& from) {
    if (fault.node != NodeId{} || from.empty()) return fault.node;
    return from[fault.pick % from.size()];
  };
  switch (fault.kind) {
    case FaultKind::kCut:
    case FaultKind::kBreak:
      return begin_between(fault, end_ns);
    case FaultKind::kLastingCut:
      return cut_for_good(static_cast<LastingCut>(fault.amount), fault.pick);
    case FaultKind::kStop: {
      const NodeId node = pick(living());
      if (node != NodeId{}) network_.stop(node, end_ns);
      return node != NodeId{};
    }
    case FaultKind::kSlow: {
      Server* server = find(pick(living_servers()));
      if (server == nullptr) return false;
      server->work_ns = fault.amount;
      plan(end_ns, [this, node = server->node] { find(node)->work_ns = 0; });
      return true;
    }
    case FaultKind::kClockJump:
      return jump(fault);
    case FaultKind::kCrash:
      return crash_server(pick(living_servers()), length_ns);
    case FaultKind::kCoordinatorCrash:
    case FaultKind::kPowerLoss:
      return begin_coordinator_crash(fault, length_ns);
    case FaultKind::kCrashInRecovery:
      armed_.push_back(fault);
      return false;  // it has not happened yet
    case FaultKind::kDiskFull:
    case FaultKind::kDiskFailing:
      return begin_disk_fault(fault.kind, end_ns);
    case FaultKind::kJoin:
      start_server();
      return true;
    case FaultKind::kDrain:
      drain(pick(living_servers()));
      return false;  // it has not happened yet
  }
  return false;
}

bool SimulatedCluster::begin_between(const Fault& fault, std::uint64_t end_ns) {
  NodeId node = fault.node;
  NodeId peer = fault.peer;
  if (node == NodeId{}) {
    std::vector<NodeId> nodes = living();
    if (nodes.size() < 2) return false;
    const auto first = nodes.begin() + static_cast<std::ptrdiff_t>(fault.pick % nodes.size());
    const std::uint64_t rest = fault.pick / nodes.size();
    node = *first;
    nodes.erase(first);
    peer = nodes[rest % nodes.size()];
  }
  if (fault.kind == FaultKind::kBreak) {
    network_.break_connection(node, peer);
  } else {
    network_.cut(node, peer);
    plan(end_ns, [this, node, peer] { network_.heal(node, peer); });
  }
  return true;
}

bool SimulatedCluster::cut_for_good(LastingCut which, std::uint64_t pick) {
  const std::vector<NodeId> nodes = living_servers();
  if (nodes.size() < 2) return false;
  const NodeId node = nodes[pick % nodes.size()];
  std::vector<NodeId> others = nodes;
  std::erase(others, node);
  switch (which) {
    case LastingCut::kToServer:
    case LastingCut::kBetweenServers:
      others = {others[pick / nodes.size() % others.size()]};
      break;
    case LastingCut::kToAllServers:
    case LastingCut::kFromAllServers:
    case LastingCut::kOfAllServers:
      break;
    case LastingCut::kFromCoordinator:
    case LastingCut::kToCoordinator: {
      const auto in_touch = [this](NodeId server) { return !without_coordinator_.contains(server); };
      if (std::ranges::none_of(others, in_touch)) return false;
      without_coordinator_.insert(node);
      others = {kCoordinatorNode};
      break;
    }
  }
  const bool is_deaf = which == LastingCut::kFromAllServers || which == LastingCut::kFromCoordinator;
  const bool is_both = which == LastingCut::kBetweenServers || which == LastingCut::kOfAllServers;
  for (const NodeId other : others) {
    if (is_deaf || is_both) network_.cut_one_way(other, node);
    if (!is_deaf) network_.cut_one_way(node, other);
  }
  return true;
}

bool SimulatedCluster::jump(const Fault& fault) {
  const std::vector<NodeId> nodes = living();
  if (nodes.empty()) return false;
  const NodeId node = nodes[fault.pick % nodes.size()];
  if (node == kCoordinatorNode) {
    coordinator_clock_.jump(fault.amount);
    calendar_ms_ += static_cast<std::int64_t>(fault.pick % (2 * kDayMs)) - static_cast<std::int64_t>(kDayMs);
  } else {
    find(node)->clock.jump(fault.amount);
  }
  network_.set_timer(node, network_.now_ns());
  return true;
}

bool SimulatedCluster::begin_coordinator_crash(const Fault& fault, std::uint64_t absent_ns) {
  if (!coordinator_ || dying_) return false;
  const bool loses_power = fault.kind == FaultKind::kPowerLoss;
  if (fault.amount == 0) {
    crash_coordinator_for(loses_power, absent_ns);
    return true;
  }
  dying_ = Dying{++last_dying_, loses_power, absent_ns};
  disk_.end_user_after(fault.amount);
  plan(network_.now_ns() + kDyingNs, [this, number = last_dying_] {
    if (dying_ && dying_->number == number) crash_coordinator_for(dying_->loses_power, dying_->absent_ns);
  });
  return true;
}

bool SimulatedCluster::begin_disk_fault(FaultKind kind, std::uint64_t end_ns) {
  const auto change = [this, kind](int by) {
    if (kind == FaultKind::kDiskFull) {
      disk_.set_full((full_disks_ += by) > 0);
    } else {
      disk_.set_failing((failing_disks_ += by) > 0);
    }
  };
  change(1);
  plan(end_ns, [change] { change(-1); });
  return true;
}

// As an operator would; nothing happens where that is refused, or the coordinator is lost before it is done.
void SimulatedCluster::drain(NodeId node) {
  if (!coordinator_ || node == NodeId{}) return;
  const auto call = std::make_shared<ClientCall<v1::DrainRequest, v1::DrainReply>>();
  call->request.set_node(node.value);
  call->reply = [this, node](const absl::Status& status, const v1::DrainReply&) {
    if (!status.ok()) return;
    ++fault_counts_[static_cast<std::size_t>(FaultKind::kDrain)];
    plan(network_.now_ns(), [this, node] { end_server(node); });
  };
  requests_.push_back([this, call] { coordinator_->handle(std::move(*call), now()); });
  network_.set_timer(kCoordinatorNode, network_.now_ns());
}

void SimulatedCluster::begin_crash_in_recovery() {
  const Fault fault = armed_.back();
  armed_.pop_back();
  plan(network_.now_ns() + fault.amount, [this, fault] {
    const std::vector<NodeId> nodes = living();
    if (nodes.empty()) return;
    const NodeId node = nodes[fault.pick % nodes.size()];
    const std::uint64_t absent_ns = fault.end_ns - fault.begin_ns;
    if (node == kCoordinatorNode) {
      crash_coordinator_for(false, absent_ns);
    } else {
      crash_server(node, absent_ns);
    }
    ++fault_counts_[static_cast<std::size_t>(FaultKind::kCrashInRecovery)];
  });
}

}  // namespace tessera
