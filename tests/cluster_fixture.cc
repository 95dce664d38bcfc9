#include "tests/cluster_fixture.h"

#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>

#include "lpss/simulation/simulation.h"
#include "worlds/loader/world_file.h"

namespace tessera::testing {
namespace {

// Logs of daemons that were lost, as tests want them to be, are kept: all in one folder, that goes away.
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
  absl::StatusOr<std::unique_ptr<Client>> client = Client::connect((*processes)->address(), kPatience);
  EXPECT_THAT(client.status(), IsOk());
  if (!client.ok()) return {};
  return {*std::move(processes), *std::move(client)};
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

Program::Program(const std::string& name, const std::vector<std::string>& arguments)
    : process_(absl::UnknownError("not started")) {
  const absl::StatusOr<std::filesystem::path> folder = cli::make_temporary_folder();
  EXPECT_THAT(folder.status(), IsOk());
  folder_ = folder.ok() ? *folder : std::filesystem::path();
  process_ = cli::ChildProcess::start(cli::executable_folder() / name, arguments, folder_ / "output");
  EXPECT_THAT(process_.status(), IsOk());
}

Program::~Program() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

int Program::wait() {
  if (!cli::wait_readable({process_->descriptor()}, kPatience)) {
    ADD_FAILURE() << process_->name() << " did not end in time; it said:\n" << output();
    return -1000;
  }
  return *process_->ended();
}

bool Program::await_output(const std::string& text) {
  const int inotify = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  inotify_add_watch(inotify, folder_.c_str(), IN_MODIFY | IN_CREATE);
  const absl::Time deadline = absl::Now() + kPatience;
  bool said = false;
  for (bool ended = false; !ended;) {
    ended = process_->ended().has_value() || absl::Now() > deadline;
    said = output().find(text) != std::string::npos;
    if (said || ended) break;
    cli::wait_readable({inotify, process_->descriptor()}, deadline - absl::Now());
    char events[4096];
    while (read(inotify, events, sizeof events) > 0) {
    }
  }
  close(inotify);
  return said;
}

std::string Program::output() const {
  std::ifstream file(folder_ / "output");
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Outcome run_tessera(const std::vector<std::string>& arguments) {
  Program program("tessera", arguments);
  const int code = program.wait();
  return {code, program.output()};
}

}  // namespace tessera::testing
