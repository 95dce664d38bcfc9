#include "tests/cluster_fixture.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/time/clock.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <system_error>

#include "lpss/simulation/simulation.h"
#include "worlds/loader/world_file.h"

namespace tessera::testing {
namespace {

// LocalCluster keeps the logs of daemons that fail: collect them in one folder that is removed in the end.
class TemporaryFolder : public ::testing::Environment {
 public:
  void SetUp() override {
    const absl::StatusOr<std::filesystem::path> folder = cli::make_temporary_folder();
    ASSERT_THAT(folder.status(), IsOk());
    folder_ = *folder;
    setenv("TMPDIR", folder_.c_str(), 1);
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

 private:
  std::filesystem::path folder_;
};

const ::testing::Environment* const temporary_folder =
    ::testing::AddGlobalTestEnvironment(new TemporaryFolder);

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// Waits until `wanted` accepts the text of the file, or until its writer has ended, which makes the
// descriptor `writer` readable (-1: none). Returns whether the text was accepted.
bool await_text(const std::filesystem::path& file, int writer,
                const std::function<bool(const std::string&)>& wanted) {
  const int inotify = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  inotify_add_watch(inotify, file.parent_path().c_str(), IN_MODIFY | IN_CREATE);
  std::vector<int> descriptors = {inotify};
  if (writer >= 0) descriptors.push_back(writer);
  const absl::Time deadline = absl::Now() + kPatience;
  bool is_wanted = false;
  for (bool ended = false; !ended;) {
    ended = absl::Now() > deadline || (writer >= 0 && cli::wait_readable({writer}, absl::ZeroDuration()));
    is_wanted = wanted(text_of(file));
    if (is_wanted || ended) break;
    cli::wait_readable(descriptors, deadline - absl::Now());
    char events[4096];
    while (read(inotify, events, sizeof events) > 0) {
    }
  }
  close(inotify);
  return is_wanted;
}

}  // namespace

std::filesystem::path world_file(const std::string& name) {
  return std::filesystem::path(TESSERA_OWN_WORLDS) / name;
}

WorldDescription read_world(const std::string& name) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_file(world_file(name));
  EXPECT_THAT(loaded.status(), IsOk());
  return loaded.ok() ? loaded->world : WorldDescription();
}

WorldDescription flat_world(double sector_size) {
  WorldDescription world;
  world.name = "flat";
  world.settings.sector_size = sector_size;
  BodyDescription ground;
  ground.name = "ground";
  ground.properties.motion = Motion::kStatic;
  world.shapes.push_back(Shape{{ShapePart{Plane{}, Pose{}}}});
  world.bodies.push_back(ground);
  return world;
}

BodyDescription& add(WorldDescription& world, const NewBody& body) {
  world.bodies.push_back(body.body);
  BodyDescription& added = world.bodies.back();
  added.properties.shape = static_cast<ShapeId>(world.shapes.size());
  world.shapes.push_back(body.shape);
  const WorldPosition& position = body.body.pose.position;
  const absl::StatusOr<WorldPosition> moved =
      canonical(position.sector, position.local, world.settings.sector_size);
  EXPECT_THAT(moved.status(), IsOk());
  if (moved.ok()) added.pose.position = *moved;
  return added;
}

std::string hash_in_process(const WorldDescription& world, std::uint64_t ticks) {
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
  EXPECT_THAT(simulation.status(), IsOk());
  if (!simulation.ok()) return "";
  for (std::uint64_t tick = 0; tick < ticks; ++tick) (*simulation)->step();
  return (*simulation)->hash().to_string();
}

Cluster start_cluster(int servers, const cli::LocalClusterOptions& given) {
  cli::LocalClusterOptions options = given;
  options.servers = servers;
  options.start_timeout = kPatience;
  if (given.join_timeout == cli::LocalClusterOptions().join_timeout) options.join_timeout = kPatience;
  absl::StatusOr<std::unique_ptr<cli::LocalCluster>> processes = cli::LocalCluster::start(options);
  EXPECT_THAT(processes.status(), IsOk());
  if (!processes.ok()) return {};
  absl::StatusOr<std::unique_ptr<Client>> client =
      Client::connect((*processes)->address(), kPatience, options.keys);
  EXPECT_THAT(client.status(), IsOk());
  if (!client.ok()) return {};
  return {*std::move(processes), *std::move(client)};
}

bool await_log(const Cluster& cluster, const std::string& text) {
  return await_text(cluster.processes->coordinator_log(), -1,
                    [&](const std::string& log) { return log.find(text) != std::string::npos; });
}

bool await_joined(const Cluster& cluster, int servers) {
  return await_text(cluster.processes->coordinator_log(), -1, [servers](const std::string& log) {
    const std::vector<std::string> lines = absl::StrSplit(log, '\n');
    const auto is_join = [](const std::string& line) {
      return absl::StrContains(line, " joined, precision ");
    };
    return std::count_if(lines.begin(), lines.end(), is_join) >= servers;
  });
}

std::set<std::string> shared_memory() {
  std::set<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm", error))
    names.insert(entry.path().string());
  return names;
}

bool runs(pid_t process) { return kill(process, 0) == 0; }

std::vector<pid_t> children_of(pid_t process) {
  std::ifstream file(absl::StrCat("/proc/", process, "/task/", process, "/children"));
  return {std::istream_iterator<pid_t>(file), std::istream_iterator<pid_t>()};
}

std::string name_of(pid_t process) {
  std::string name = text_of(absl::StrCat("/proc/", process, "/comm"));
  if (name.ends_with('\n')) name.pop_back();
  return name;
}

Processes::Processes(std::vector<pid_t> ids) : ids_(std::move(ids)) {
  for (const pid_t id : ids_) descriptors_.push_back(cli::open_process(id));
}

Processes::~Processes() {
  for (const int descriptor : descriptors_) close(descriptor);
}

bool Processes::await_end() const {
  return std::all_of(descriptors_.begin(), descriptors_.end(),
                     [](int descriptor) { return cli::wait_readable({descriptor}, kPatience); });
}

Process::Process(const std::string& name, const std::vector<std::string>& arguments)
    : process_(absl::UnknownError("not started")) {
  const absl::StatusOr<std::filesystem::path> folder = cli::make_temporary_folder();
  EXPECT_THAT(folder.status(), IsOk());
  folder_ = folder.ok() ? *folder : std::filesystem::path();
  process_ = cli::ChildProcess::start(cli::executable_folder() / name, arguments, folder_ / "output");
  EXPECT_THAT(process_.status(), IsOk());
}

Process::~Process() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

int Process::wait() {
  if (!cli::wait_readable({process_->descriptor()}, kPatience)) {
    ADD_FAILURE() << process_->name() << " did not end in time; its output:\n" << output();
    return -1000;
  }
  return *process_->ended();
}

bool Process::await_output(const std::string& text) {
  return await_text(folder_ / "output", process_->descriptor(),
                    [&](const std::string& output) { return output.find(text) != std::string::npos; });
}

std::string Process::output() const { return text_of(folder_ / "output"); }

Outcome run_tessera(const std::vector<std::string>& arguments) {
  Process program("tessera", arguments);
  const int code = program.wait();
  return {code, program.output()};
}

}  // namespace tessera::testing
