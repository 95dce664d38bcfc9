// A drill for root: a cluster on hosts of its own, to which everything happens that docs/operations.md names,
// in any order, for as long as wanted. Each life of the world, from a load or restore to the next, must have
// the hash of the undisturbed run; a world that is set aside must say why.
//
//   TESSERA_MINUTES=60 TESSERA_ETCD=0 TESSERA_PATIENCE=300 TESSERA_SEED=7 build/release/bin/chaos_drill
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/time/clock.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <future>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "tests/standby_cluster.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr std::size_t kServers = 3;
constexpr absl::Duration kSmallMemoryEnds = absl::Seconds(20);
constexpr const char* kMemoryGroups = "/sys/fs/cgroup/memory";

// Of a variable of the environment.
int number_from(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  int number = otherwise;
  return text != nullptr && absl::SimpleAtoi(text, &number) ? number : otherwise;
}

bool write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text << std::flush;
  return out.good();
}

// A cgroup of version 1 with little memory; none where the system has no such groups.
class SmallMemory {
 public:
  explicit SmallMemory(int mib)
      : folder_(std::filesystem::path(kMemoryGroups) / absl::StrCat("tessera-chaos-", getpid())) {
    std::error_code error;
    std::filesystem::create_directory(folder_, error);
    is_there_ = write_text(folder_ / "memory.limit_in_bytes", absl::StrCat(mib, "M"));
  }
  ~SmallMemory() { rmdir(folder_.c_str()); }
  SmallMemory(const SmallMemory&) = delete;

  bool is_there() const { return is_there_; }
  bool take(pid_t process) const { return write_text(folder_ / "cgroup.procs", absl::StrCat(process)); }

 private:
  std::filesystem::path folder_;
  bool is_there_ = false;
};

// What happened, by kind.
class Tally {
 public:
  void add(const std::string& kind, double gap_s, Tick missed) {
    of_kind_[kind].add(gap_s, missed);
    all_.add(gap_s, missed);
  }

  void print() const {
    for (const auto& [kind, faults] : of_kind_) print(kind, faults);
    print("all", all_);
  }

 private:
  struct Faults {
    std::vector<double> gaps_s;
    Tick missed = 0;  // by a stream

    void add(double gap_s, Tick more) {
      gaps_s.push_back(gap_s);
      missed += more;
    }
  };

  static void print(const std::string& kind, Faults faults) {
    std::sort(faults.gaps_s.begin(), faults.gaps_s.end());
    const auto at = [&](std::size_t percent) {
      return faults.gaps_s[(faults.gaps_s.size() - 1) * percent / 100];
    };
    std::printf("%-40s %4zu times; without ticks: p50 %5.2f s, p99 %5.2f s, max %5.2f s; %llu missed\n",
                kind.c_str(), faults.gaps_s.size(), at(50), at(99), at(100),
                static_cast<unsigned long long>(faults.missed));
  }

  std::map<std::string, Faults> of_kind_;
  Faults all_;
};

class Chaos : public StandbyCluster {
 protected:
  struct Fault {
    const char* name;
    void (Chaos::*happens)();
    bool needs_etcd = false;
  };

  void SetUp() override {
    has_etcd_ = number_from("TESSERA_ETCD", 1) != 0;
    lease_seconds_ = number_from("TESSERA_LEASE", 4);
    patience_ = absl::Seconds(number_from("TESSERA_PATIENCE", 300));
    may_miss_ticks_ = true;
    watches_contacts_ = false;
    // Mounts end with this process and those that it starts.
    ASSERT_EQ(unshare(CLONE_NEWNS), 0) << std::strerror(errno);
    ASSERT_EQ(mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr), 0) << std::strerror(errno);
    disks_ = *cli::make_temporary_folder();
    for (const std::size_t place : {0, 1}) {
      std::filesystem::create_directory(disk(place));
      ASSERT_EQ(mount("tmpfs", disk(place).c_str(), "tmpfs", 0, "size=64m"), 0) << std::strerror(errno);
      stores_[place] = disk(place) / "store";
    }
    start_all(&network_);
  }

  // Also of a run that went wrong.
  void TearDown() override {
    tally_.print();
    std::printf(
        "%d lives of the world with the right hash, %d set aside with a reason; %d streams opened anew\n",
        lives_, set_aside_, reopened_);
  }

  std::filesystem::path disk(std::size_t place) const { return disks_ / absl::StrCat("disk-", place); }
  std::size_t any_server() { return random_() % kServers; }
  absl::Duration any_time() { return absl::Milliseconds(300 + random_() % 6000); }

  void read_for(absl::Duration time) {
    const absl::Time end = absl::Now() + time;
    while (absl::Now() < end && !HasFatalFailure()) read_what_is_there(end);
  }

  // What `call` returns; streams are read meanwhile, as clients do.
  template <typename Call>
  auto reading(const Call& call) {
    auto result = std::async(std::launch::async, call);
    while (result.wait_for(std::chrono::seconds(0)) != std::future_status::ready && !HasFatalFailure())
      read_what_is_there(absl::Now() + absl::Milliseconds(20));
    return result.get();
  }

  // --- processes ---

  void kill_and_replace_server(std::size_t place) {
    servers_[place]->signal(SIGKILL);
    start_server(place);
  }
  void server_killed() { kill_and_replace_server(any_server()); }
  void all_servers_killed() {
    for (std::size_t place = 0; place < kServers; ++place) kill_and_replace_server(place);
  }
  void coordinator_killed() {
    const std::size_t place = leader();
    coordinators_[place]->signal(SIGKILL);
    cli::wait_readable({coordinators_[place]->descriptor()}, patience_);
    start_coordinator(place);
  }
  void coordinator_ended() {
    const std::size_t place = leader();
    coordinators_[place]->signal(SIGTERM);
    cli::wait_readable({coordinators_[place]->descriptor()}, patience_);
    start_coordinator(place);
  }
  void everything_killed() {
    const std::size_t place = leader();
    coordinators_[place]->signal(SIGKILL);
    cli::wait_readable({coordinators_[place]->descriptor()}, patience_);
    all_servers_killed();
    start_coordinator(place);
  }
  void etcd_killed() {
    etcd_->signal(SIGKILL);
    cli::wait_readable({etcd_->descriptor()}, patience_);
    start_etcd();
  }
  void stopped(cli::ChildProcess& process) {
    process.signal(SIGSTOP);
    read_for(any_time());
    process.signal(SIGCONT);
  }
  void server_stopped() { stopped(*servers_[any_server()]); }
  void coordinator_stopped() { stopped(*coordinators_[leader()]); }
  void etcd_stopped() { stopped(*etcd_); }

  void server_drained() {
    const std::size_t place = any_server();
    const absl::StatusOr<ClusterStatus> status = client_->status(patience_);
    ASSERT_THAT(status.status(), IsOk());
    for (const ServerStatus& server : status->servers) {
      if (server.stream_address != server_address(place)) continue;
      const absl::StatusOr<Tick> left =
          reading([&] { return client_->drain(server.node, absl::Seconds(20)); });
      if (!left.ok()) std::printf("  not drained: %s\n", left.status().ToString().c_str());
    }
    servers_[place]->signal(SIGTERM);
    cli::wait_readable({servers_[place]->descriptor()}, patience_);
    start_server(place);
  }

  // In the place of another one comes a server that the system ends, since its group has too little memory.
  void server_without_memory() {
    const SmallMemory memory(3);
    if (!memory.is_there()) return static_cast<void>(std::printf("  no groups with limits of memory here\n"));
    const std::size_t place = any_server();
    kill_and_replace_server(place);
    ASSERT_TRUE(memory.take(servers_[place]->pid()));
    const absl::Time end = absl::Now() + kSmallMemoryEnds;
    while (!servers_[place]->ended() && absl::Now() < end && !HasFatalFailure())
      read_what_is_there(absl::Now() + absl::Milliseconds(100));
    std::printf("  %s\n", servers_[place]->ended() ? "ended by the system" : "had enough");
    servers_[place]->signal(SIGKILL);
    cli::wait_readable({servers_[place]->descriptor()}, patience_);
    start_server(place);
  }

  // --- network ---

  void host_cut() {
    std::vector<std::size_t> hosts = {kCoordinatorHosts + leader()};
    if (has_etcd_) hosts.insert(hosts.end(), {kEtcdHost, kCoordinatorHosts + 1 - leader()});
    for (std::size_t place = 0; place < kServers; ++place) hosts.push_back(kServerHosts + place);
    const std::size_t host = hosts[random_() % hosts.size()];
    network_.cut(host, true);
    read_for(any_time());
    network_.cut(host, false);
  }

  struct Cut {
    std::size_t host;
    std::size_t peer;
    bool to_peer;
    bool from_peer;
  };
  // Between a server and another one, or the coordinator that leads.
  Cut any_cut() {
    const std::size_t host = kServerHosts + any_server();
    std::size_t peer = kServerHosts + any_server();
    if (peer == host) peer = kCoordinatorHosts + leader();
    const std::uint64_t ways = 1 + random_() % 3;
    return {host, peer, (ways & 1) != 0, (ways & 2) != 0};
  }
  void set(const Cut& cut, bool is_cut) {
    if (cut.to_peer) network_.cut_way(cut.host, cut.peer, is_cut);
    if (cut.from_peer) network_.cut_way(cut.peer, cut.host, is_cut);
  }
  void link_cut() {
    const Cut cut = any_cut();
    set(cut, true);
    read_for(absl::Seconds(5) + any_time());
    set(cut, false);
    if (lasting_cut_) set(*lasting_cut_, true);
  }
  // Other faults happen meanwhile, until the next cut of this kind.
  void link_cut_for_good() {
    if (lasting_cut_) set(*lasting_cut_, false);
    lasting_cut_ = any_cut();
    set(*lasting_cut_, true);
    read_for(absl::Seconds(3));
  }
  void slow_and_lossy() {
    network_.disturb(std::chrono::milliseconds(50), 10);
    read_for(any_time());
    network_.disturb(std::chrono::milliseconds(0), 0);
  }

  // --- disks ---

  // A push while the store fails: it may be refused.
  void push_until(const std::function<void()>& mended) {
    const BodyId body = dynamic_[pushes_.size() % dynamic_.size()];
    const Eigen::Vector3d impulse(0.2, 0, 0.5);
    std::future<absl::StatusOr<Tick>> given = std::async(std::launch::async, [&] {
      return client_->apply_impulse(body, impulse, Eigen::Vector3d::Zero(), patience_);
    });
    read_for(any_time());
    mended();
    const absl::StatusOr<Tick> tick = given.get();
    std::printf("  a push meanwhile: %s\n", tick.status().ToString().c_str());
    ASSERT_TRUE(tick.ok() || absl::IsResourceExhausted(tick.status())) << tick.status();
    if (tick.ok()) pushes_.push_back({*tick, body, impulse});
  }
  void disk_full() {
    const std::size_t place = leader();
    const std::filesystem::path file = disk(place) / "all-that-is-left";
    const int filler = open(file.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    ASSERT_GE(filler, 0);
    struct statvfs room {};
    ASSERT_EQ(statvfs(disk(place).c_str(), &room), 0);
    static_cast<void>(posix_fallocate(filler, 0, static_cast<off_t>(room.f_bavail * room.f_bsize)));
    close(filler);
    push_until([&] { std::filesystem::remove(file); });
  }
  void store_taken_away() {
    const std::size_t place = leader();
    const std::filesystem::path elsewhere = disk(place) / "elsewhere";
    std::filesystem::rename(stores_[place], elsewhere);
    push_until([&] {
      std::error_code ignored;
      std::filesystem::remove_all(stores_[place], ignored);
      std::filesystem::rename(elsewhere, stores_[place]);
    });
  }

  // --- worlds ---

  // All pushes so far have taken effect when it is written.
  void snapshot_written() {
    const absl::StatusOr<SnapshotSummary> written =
        reading([&] { return client_->snapshot(snapshot_file(), patience_); });
    ASSERT_THAT(written.status(), IsOk());
    snapshot_tick_ = written->tick;
  }
  void world_restored() {
    if (!snapshot_tick_) return snapshot_written();
    const Tick tick = *snapshot_tick_;
    replace([&] { return client_->restore(snapshot_file(), /*replace=*/true).status(); }, tick);
  }
  void world_loaded() {
    snapshot_tick_.reset();
    replace([&] { return client_->load(world_, /*replace=*/true).status(); }, 0);
  }
  // A server may end meanwhile. Where the new world cannot be loaded, the old one must be there.
  // A load needs all servers, so the coordinator must hear them.
  void replace(const std::function<absl::Status()>& load, Tick tick) {
    if (lasting_cut_) set(*lasting_cut_, false);
    lasting_cut_.reset();
    expect_as_undisturbed();
    ASSERT_FALSE(HasFailure());
    ++lives_;
    bodies_.reset();
    std::future<absl::Status> loaded = std::async(std::launch::async, load);
    const bool with_kill = random_() % 2 == 0;
    if (with_kill) {
      cli::wait_readable({}, absl::Milliseconds(random_() % 100));
      kill_and_replace_server(any_server());
    }
    const absl::Status status = loaded.get();
    std::printf("  %s: %s\n", with_kill ? "while a server was killed" : "undisturbed",
                status.ToString().c_str());
    if (status.ok()) return begin_again(tick);
    ASSERT_TRUE(with_kill) << status;
    const Tick old = told_;
    const absl::StatusOr<HashAt> hash = client_->hash(patience_);
    ASSERT_THAT(hash.status(), IsOk());
    ASSERT_EQ(hash->hash, Undisturbed(world_, pushes_, old).hash) << "the old world goes on";
    begin(*client_);
  }

  std::filesystem::path snapshot_file() const { return disks_ / "snapshot"; }

  void look_after() override { replace_ended(); }

  // What ended by itself, as servers do that find no coordinator for long, is started anew, as systemd would.
  void replace_ended() {
    for (std::size_t place = 0; place < kServers; ++place) {
      if (servers_[place]->ended()) start_server(place);
    }
    for (const std::size_t place : {0, 1}) {
      if (coordinators_[place] && coordinators_[place]->ended()) start_coordinator(place);
    }
    if (etcd_ && etcd_->ended()) start_etcd();
  }

  // Until commands are accepted again. A world that has failed is set aside, with its reason, and another one
  // takes its place.
  void await_world() {
    const absl::Time end = absl::Now() + patience_;
    absl::StatusOr<ClusterStatus> status = absl::UnavailableError("not asked yet");
    while (absl::Now() < end &&
           (absl::IsUnavailable(status.status()) ||
            (status.ok() && (status->waits_for_store || !status->store_failure.empty()))))
      status = reading([&] { return client_->status(patience_); });
    ASSERT_THAT(status.status(), IsOk());
    ASSERT_EQ(status->store_failure, "");
    if (status->state != "failed") return;
    std::printf("  set aside: %s\n", status->failure.c_str());
    ASSERT_FALSE(status->failure.empty());
    ASSERT_TRUE(has_etcd_ || std::filesystem::exists(stores_[0] / "failed" / "reason"));
    ++set_aside_;
    snapshot_tick_.reset();
    begin(*client_);
  }

  std::vector<Fault> faults() const {
    std::vector<Fault> all = {
        {"server killed", &Chaos::server_killed},
        {"all servers killed", &Chaos::all_servers_killed},
        {"coordinator killed", &Chaos::coordinator_killed},
        {"coordinator ended (SIGTERM)", &Chaos::coordinator_ended},
        {"everything killed", &Chaos::everything_killed},
        {"etcd killed", &Chaos::etcd_killed, true},
        {"server stopped", &Chaos::server_stopped},
        {"coordinator stopped", &Chaos::coordinator_stopped},
        {"etcd stopped", &Chaos::etcd_stopped, true},
        {"server drained and replaced", &Chaos::server_drained},
        {"server without memory", &Chaos::server_without_memory},
        {"host cut off, healed", &Chaos::host_cut},
        {"link cut, one way or both, healed", &Chaos::link_cut},
        {"link cut, one way or both, not healed", &Chaos::link_cut_for_good},
        {"network slow and lossy", &Chaos::slow_and_lossy},
        {"disk of the store full", &Chaos::disk_full},
        {"folder of the store taken away", &Chaos::store_taken_away},
        {"snapshot, later restore --replace", &Chaos::world_restored},
        {"load --replace", &Chaos::world_loaded},
    };
    if (!has_etcd_) std::erase_if(all, [](const Fault& fault) { return fault.needs_etcd; });
    return all;
  }

  std::mt19937 random_;
  HostNetwork network_{kHosts};
  std::filesystem::path disks_;
  std::optional<Cut> lasting_cut_;
  std::optional<Tick> snapshot_tick_;
  Tally tally_;
  int lives_ = 0;
  int set_aside_ = 0;
};

TEST_F(Chaos, EverythingThatCanHappen) {
  const int seed = number_from("TESSERA_SEED", static_cast<int>(std::random_device()() >> 1));
  std::printf("TESSERA_SEED=%d TESSERA_ETCD=%d\n", seed, has_etcd_ ? 1 : 0);
  random_.seed(static_cast<std::uint32_t>(seed));
  const absl::Time begin = absl::Now();
  const absl::Time end = begin + absl::Minutes(number_from("TESSERA_MINUTES", 5));
  std::vector<Fault> left;  // each kind comes once before any comes again
  while (absl::Now() < end) {
    if (left.empty()) {
      left = faults();
      std::shuffle(left.begin(), left.end(), random_);
    }
    const Fault fault = left.back();
    left.pop_back();
    go_on(20 + random_() % 60);
    if (HasFatalFailure()) return;
    longest_gap_ = absl::ZeroDuration();
    const Tick missed_before = missed_;
    std::printf("%5.0f s, tick %llu: %s\n", absl::ToDoubleSeconds(absl::Now() - begin),
                static_cast<unsigned long long>(told_), fault.name);
    std::fflush(stdout);
    (this->*fault.happens)();
    if (HasFatalFailure()) return;
    replace_ended();
    await_world();
    if (HasFatalFailure()) return;
    go_on(60);
    tally_.add(fault.name, absl::ToDoubleSeconds(longest_gap_), missed_ - missed_before);
  }
  expect_as_undisturbed();
  if (!HasFailure()) ++lives_;
}

}  // namespace
}  // namespace tessera
