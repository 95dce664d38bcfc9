// The `tessera` command as users see it: exit codes, messages, reports.
#include <csignal>
#include <cstdint>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A report written by `tessera run`, in a temporary folder.
class RunTest : public ::testing::Test {
 protected:
  RunTest() : folder_(cli::make_temporary_folder().value()) {}
  ~RunTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  nlohmann::json run(std::vector<std::string> arguments) {
    const std::filesystem::path file = folder_ / "report.json";
    for (const std::string& more : {std::string("--json"), file.string()}) arguments.push_back(more);
    arguments.insert(arguments.begin(), "run");
    const Outcome outcome = run_tessera(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    std::ifstream in(file);
    return nlohmann::json::parse(in, nullptr, false);
  }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  std::filesystem::path folder_;
};

TEST_F(RunTest, ReportsTheSameFieldsWithAndWithoutServers) {
  const std::string world = world_file("seam.sdf").string();
  const nlohmann::json alone = run({world, "--in-process", "--seconds", "1"});
  const nlohmann::json cluster = run({world, "--servers", "3", "--seconds", "1"});
  for (const char* field :
       {"world_hash", "ticks", "bodies", "sectors", "clones_max", "islands_across_seams", "islands_shipped",
        "diverged", "settings", "real_time_factor", "tick_ms", "peak_rss_mb", "servers", "threads", "notices",
        "repairs", "load_seconds", "wall_seconds"}) {
    EXPECT_TRUE(alone.contains(field)) << field;
    EXPECT_TRUE(cluster.contains(field)) << field;
  }
  for (const char* of : {"mean", "p50", "p99", "max"}) {
    EXPECT_TRUE(alone["tick_ms"].contains(of)) << of;
    EXPECT_TRUE(cluster["tick_ms"].contains(of)) << of;
  }
  for (const TickCounter& counter : kTickCounters) EXPECT_TRUE(cluster.contains(counter.name_in_run));
  for (const WorldSetting& setting : kSettings) EXPECT_TRUE(cluster["settings"].contains(setting.name));
  for (const char* field : {"world_hash", "ticks", "bodies", "sectors", "clones_max", "contacts_max",
                            "islands_across_seams", "settings"}) {
    EXPECT_EQ(alone[field], cluster[field]) << field;
  }
  EXPECT_EQ(alone["ticks"], 60);
  EXPECT_GT(alone["islands_across_seams"].get<int>(), 0);
  EXPECT_EQ(alone["islands_shipped"], 0);
  EXPECT_GT(cluster["islands_shipped"].get<int>(), 0) << "both towers stand on borders between servers";
}

TEST_F(RunTest, ProvesItself) {
  const nlohmann::json report = run({world_file("seam.sdf").string(), "--seconds", "1", "--prove"});
  EXPECT_EQ(report["proof"]["same_bits"], true);
  EXPECT_EQ(report["proof"]["tessera"]["towers"]["standing"], 2);
  EXPECT_EQ(report["proof"]["plain_bullet"]["towers"]["towers"], 2);
  EXPECT_GT(report["proof"]["plain_bullet"]["movement"]["coordinate_step_m"],
            report["proof"]["tessera"]["movement"]["coordinate_step_m"]);
}

TEST_F(RunTest, ShiftAndPrecisionDoWhatTheySay) {
  const std::string world = world_file("busy.sdf").string();
  const auto hash = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {world, "--in-process", "--seconds", "1"});
    return run(more)["world_hash"].get<std::string>();
  };
  const std::string here = hash({});
  EXPECT_EQ(hash({"--shift", "2^62,-2^62,2^40"}), here);
  EXPECT_EQ(hash({"--threads", "3"}), here);
  const std::string in_doubles = hash({"--engine", "f64"});
  EXPECT_NE(in_doubles, here);
  EXPECT_EQ(hash({"--engine", "f64", "--shift=-2^62,1048576,0"}), in_doubles);
}

// Beside a module of another build, whose classes may differ.
TEST_F(RunTest, EnginesOfOtherBuildsAreRefused) {
  const std::filesystem::path build = cli::executable_folder();
  std::filesystem::copy_file(build / "tessera", folder_ / "tessera");
  std::filesystem::copy_file(build / "libengine-of-another-build.so", folder_ / "libtessera-engine-f32.so");
  Process program((folder_ / "tessera").string(),
                  {"run", world_file("tower.sdf").string(), "--in-process", "--seconds", "1"});
  EXPECT_EQ(program.wait(), 1);
  EXPECT_THAT(program.output(), HasSubstr("libtessera-engine-f32.so is of another build of Tessera"));
}

TEST_F(RunTest, ModulesAreChecked) {
  const Outcome checked = run_tessera({"program", "check", world_file("programs/flee.wasm").string()});
  EXPECT_EQ(checked.code, 0) << checked.output;
  EXPECT_THAT(checked.output, AllOf(HasSubstr("flee@"), HasSubstr("parameter radius = 8 m (0 to 1000)"),
                                    HasSubstr("run(): 155 instructions, 0 acts")));
  const Outcome refused = run_tessera({"program", "check", world_file("flee.sdf").string()});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, HasSubstr("flee.sdf: byte 4: it is no WebAssembly module"));
}

TEST_F(RunTest, ConvertedWorldIsTheSameWorld) {
  const std::string world = world_file("machines.sdf").string();
  const std::string message = (folder_ / "machines.pb").string();
  const Outcome converted = run_tessera({"convert", world, message, "--shift", "0,0,2^50"});
  ASSERT_EQ(converted.code, 0) << converted.output;
  const nlohmann::json from_file = run({world, "--in-process", "--seconds", "0.5"});
  const nlohmann::json from_message = run({message, "--in-process", "--seconds", "0.5"});
  EXPECT_EQ(from_file["world_hash"], from_message["world_hash"]);
}

TEST_F(RunTest, FaultsThatAreMendedAreCountedOrRefused) {
  const std::string robot =
      write("robot.urdf",
            "<robot name='r'><link name='l'><inertial><mass value='1'/><inertia ixx='1' "
            "iyy='1' izz='9' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry>"
            "<sphere radius='1'/></geometry></collision></link></robot>");
  const nlohmann::json report = run({robot, "--in-process", "--seconds", "0.1"});
  ASSERT_EQ(report["repairs"].size(), 1u) << report["repairs"];
  EXPECT_THAT(report["repairs"][0].get<std::string>(), HasSubstr("1 x moment of inertia larger"));
  const Outcome converted = run_tessera({"convert", robot, (folder_ / "robot.pb").string()});
  EXPECT_EQ(converted.code, 0) << converted.output;
  EXPECT_THAT(converted.output, HasSubstr("repaired: 1 x moment of inertia larger"));
  const Outcome strict = run_tessera({"run", robot, "--in-process", "--strict"});
  EXPECT_EQ(strict.code, 1);
  EXPECT_THAT(strict.output, HasSubstr("1 x moment of inertia larger"));
}

TEST_F(RunTest, NamesThatAreNotUtf8AreRefusedAlike) {
  const std::string world =
      write("latin.sdf",
            "<sdf version='1.9'><world name='w'><model name='h\xfcgel'><link name='l'><collision "
            "name='c'><geometry><box/></geometry></collision></link></model></world></sdf>");
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"run", world, "--in-process"},
                                                    {"run", world, "--servers", "1"},
                                                    {"convert", world, (folder_ / "latin.pb").string()}}) {
    const Outcome outcome = run_tessera(arguments);
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.output, HasSubstr("body 'h\\xfcgel::l': the name must be UTF-8"));
  }
}

TEST(CommandLineTest, ExitCodesTellUsageFromFailure) {
  const std::string world = world_file("falling.sdf").string();
  EXPECT_EQ(run_tessera({}).code, 2);
  EXPECT_EQ(run_tessera({"nonsense"}).code, 2);
  EXPECT_EQ(run_tessera({"run"}).code, 2);
  EXPECT_EQ(run_tessera({"run", world, "--servers", "0"}).code, 2);
  EXPECT_EQ(run_tessera({"run", world, "--shift", "1,2"}).code, 2);
  EXPECT_EQ(run_tessera({"run", world, "--engine", "f16"}).code, 2);
  EXPECT_EQ(run_tessera({"run", "no_such_world.sdf"}).code, 1);
  EXPECT_EQ(run_tessera({"run", world, "--sector-size", "1e6"}).code, 1);
  EXPECT_EQ(run_tessera({"status", "--connect", "127.0.0.1:1"}).code, 1);
}

TEST(CommandLineTest, MessagesNameWhatAndTheBound) {
  const std::string world = world_file("falling.sdf").string();
  EXPECT_THAT(run_tessera({"run", world, "--shift", "0,2^63,0"}).output, HasSubstr("2^63"));
  EXPECT_THAT(run_tessera({"run", world, "--shift", "0,4611686018427387905,0"}).output, HasSubstr("2^62"));
  EXPECT_THAT(run_tessera({"run", "no_such_world.sdf"}).output, HasSubstr("no_such_world.sdf"));
  EXPECT_THAT(run_tessera({"run", world, "--dt", "7"}).output, HasSubstr("0.1"));
  EXPECT_THAT(run_tessera({"hash", "--connect", "127.0.0.1:1"}).output, HasSubstr("127.0.0.1:1"));
  const Outcome step = run_tessera({"step", "abc"});
  EXPECT_THAT(step.output, HasSubstr("'abc' must be a number above 0"));
  EXPECT_LT(step.output.size(), 300u);
  EXPECT_THAT(run_tessera({"run", world, "--settings", "/"}).output, HasSubstr("/ is a folder"));
  EXPECT_THAT(run_tessera({"run", world, "--shuffle", "-1"}).output,
              HasSubstr("'-1' must be an integer of 0"));
  EXPECT_THAT(run_tessera({"run", world, "--shuffle=-1"}).output, HasSubstr("'-1' must be an integer of 0"));
}

TEST(CommandLineTest, UnknownNamesAreToldWithThoseThatThereAre) {
  const Outcome experiment = run_tessera({"experiment", "nope"});
  EXPECT_EQ(experiment.code, 2);
  EXPECT_THAT(experiment.output, AllOf(HasSubstr("nope"), HasSubstr("distance"), HasSubstr("overhead"),
                                       HasSubstr("seams"), HasSubstr("tradeoff")));
  EXPECT_THAT(run_tessera({"experiment"}).output, HasSubstr("distance, extremes"));
  EXPECT_THAT(run_tessera({"nonsense"}).output, HasSubstr("experiment, find"));
  const Outcome scene = run_tessera({"experiment", "seams", "--scene", "nope"});
  EXPECT_EQ(scene.code, 1);
  EXPECT_THAT(scene.output, AllOf(HasSubstr("nope"), HasSubstr("tower_level"), HasSubstr("dominoes")));
  EXPECT_THAT(run_tessera({"experiment", "seams", "--policy", "nope"}).output, HasSubstr("clone-1, clone-2"));
}

TEST(CommandLineTest, ASignalEndsLongWorkAtOnce) {
  for (const int signal : {SIGINT, SIGTERM}) {
    Process simulate("tessera", {"simulate", "--ticks", "1", "--seeds", "1000000"});
    ASSERT_TRUE(simulate.await_output("in one process")) << simulate.output();
    simulate.process().signal(signal);
    EXPECT_EQ(simulate.wait(), kSignalled + signal) << simulate.output();
  }
}

TEST_F(RunTest, ExperimentsEndWithASignalAndWithWhatTheyHave) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::filesystem::path file = folder_ / absl::StrCat(signal, ".json");
    const std::filesystem::path rows = folder_ / absl::StrCat(signal, ".csv");
    Process truth("tessera", {"experiment", "truth", "--engine", "f32", "--json", file.string(), "--csv",
                              rows.string()});
    ASSERT_TRUE(truth.await_output("truth: ")) << truth.output();
    truth.process().signal(signal);
    EXPECT_EQ(truth.wait(), kSignalled + signal) << truth.output();
    EXPECT_THAT(truth.output(), AllOf(HasSubstr("of_the_friction_angle"), HasSubstr("interrupted after ")));
    const nlohmann::json report = nlohmann::json::parse(std::ifstream(file), nullptr, false);
    EXPECT_GT(report["rows"].size(), 0u);
    EXPECT_THAT(report["stopped"].get<std::string>(), HasSubstr("interrupted after "));
    EXPECT_TRUE(std::filesystem::exists(rows));
  }
}

TEST(CommandLineTest, AFolderIsNoFileOfSettings) {
  const std::string folder = world_file("falling.sdf").parent_path().string();
  const Outcome outcome = run_tessera({"run", world_file("falling.sdf").string(), "--settings", folder});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.output, HasSubstr("is a folder, not a file of settings"));
}

TEST(CommandLineTest, FilesThatCannotBeWrittenAreRefusedBeforeAnythingRuns) {
  const std::string world = world_file("falling.sdf").string();
  const std::string file = "/no/such/folder/report.json";
  const std::vector<std::string> commands[] = {{"run", world, "--in-process", "--json", file},
                                               {"simulate", "--json", file},
                                               {"status", "--connect", "127.0.0.1:1", "--json", file},
                                               {"tune", world, "--json", file},
                                               {"tune", world, "--write", file},
                                               {"experiment", "extremes", "--json", file},
                                               {"experiment", "extremes", "--csv", file},
                                               {"experiment", "seams", "--json", file},
                                               {"experiment", "seams", "--csv", file}};
  for (const std::vector<std::string>& command : commands) {
    const Outcome outcome = run_tessera(command);
    EXPECT_EQ(outcome.code, 2) << command.front();
    EXPECT_THAT(outcome.output, AllOf(HasSubstr(file), HasSubstr("No such file or directory")))
        << command.front();
  }
  EXPECT_THAT(run_tessera({"run", world, "--json", "/proc"}).output, HasSubstr("Is a directory"));
  EXPECT_THAT(run_tessera({"run", world, "--json", world + "/report.json"}).output,
              HasSubstr("Not a directory"));
}

TEST(CommandLineTest, EveryProgramTellsItsVersion) {
  for (const char* name : {"tessera", "tessera-coordinator", "tessera-experiments", "tessera-gateway",
                           "tessera-sector-server", "tessera-viewer"}) {
    Process program(name, {"--version"});
    EXPECT_EQ(program.wait(), 0) << name;
    EXPECT_EQ(program.output(), absl::StrCat(name, " ", TESSERA_VERSION, "\n"));
  }
}

TEST(CommandLineTest, ExperimentsAreThoseOfTheProgramBeside) {
  Process program("tessera-experiments", {"--help"});
  EXPECT_EQ(program.wait(), 0);
  const Outcome experiment = run_tessera({"experiment", "--help"});
  EXPECT_EQ(experiment.code, 0);
  EXPECT_EQ(experiment.output, program.output());
}

TEST(CommandLineTest, UnknownArgumentsAreNamedAlsoWhereOthersAreMissing) {
  for (const char* command : {"run", "load", "spawn", "remove", "raycast", "simulate", "top", "watch"}) {
    const Outcome outcome = run_tessera({command, "--no-such-option"});
    EXPECT_EQ(outcome.code, 2) << command;
    EXPECT_THAT(outcome.output, HasSubstr("--no-such-option")) << command;
  }
  EXPECT_THAT(run_tessera({"nonsense"}).output, HasSubstr("nonsense"));
  EXPECT_THAT(run_tessera({"run"}).output, HasSubstr("world, or --from FILE, is required"));
  EXPECT_THAT(run_tessera({"spawn", "box"}).output,
              HasSubstr("Usage: tessera spawn [OPTIONS]\nOptions: --name, --shape, --model, --at"));
}

TEST(CommandLineTest, EveryCommandHasHelpWithAnExample) {
  for (const char* command :
       {"run",      "up",       "load",    "unload", "spawn", "remove",   "impulse", "velocity", "force",
        "teleport", "target",   "raycast", "status", "watch", "hash",     "find",    "pause",    "resume",
        "step",     "shutdown", "config",  "top",    "belt",  "snapshot", "restore"}) {
    const Outcome outcome = run_tessera({command, "--help"});
    EXPECT_EQ(outcome.code, 0) << command;
    EXPECT_THAT(outcome.output, HasSubstr("Example:\n  tessera ")) << command;
  }
}

TEST_F(RunTest, ConfigShowChecksAFileAndSaysWhatHolds) {
  EXPECT_THAT(run_tessera({"config", "show"}).output, HasSubstr("\n#listen = \"127.0.0.1:7300\"\n"));
  const std::string file = (folder_ / "tessera.toml").string();
  std::ofstream(file) << "cluster = \"lab\"\n[sector-server]\nengine = \"f64\"\n";
  const Outcome shown = run_tessera({"config", "show", "--config", file});
  EXPECT_EQ(shown.code, 0) << shown.output;
  EXPECT_THAT(shown.output,
              ::testing::AllOf(HasSubstr("\ncluster = \"lab\"\n"), HasSubstr("\nengine = \"f64\"\n")));
  std::ofstream(file) << "[sector-server]\nengin = \"f64\"\n";
  const Outcome refused = run_tessera({"config", "show", "--config", file});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, ::testing::AllOf(HasSubstr("tessera-sector-server"), HasSubstr("'engin'")));
  EXPECT_EQ(Process("tessera-sector-server", {"--config", file}).wait(), 2);
}

TEST(CommandLineTest, ClusterIsDrivenFromTheCommandLine) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  const auto tessera = [&](std::vector<std::string> arguments) {
    arguments.push_back("--connect");
    arguments.push_back(cluster.processes->address());
    const Outcome outcome = run_tessera(arguments);
    EXPECT_EQ(outcome.code, 0) << arguments.front() << ": " << outcome.output;
    return outcome.output;
  };
  EXPECT_THAT(tessera({"load", world_file("seam.sdf").string()}), HasSubstr("on 2 servers"));
  EXPECT_THAT(tessera({"spawn", "--name", "late", "--shape", "box:1,1,1", "--mass", "10", "--at", "0,0,6"}),
              HasSubstr("from tick 1 on"));
  EXPECT_THAT(tessera({"impulse", "late", "--impulse", "0,0,-5"}), HasSubstr("tick 1"));
  EXPECT_THAT(tessera({"step", "30"}), HasSubstr("tick 30"));
  EXPECT_THAT(tessera({"velocity", "late", "--linear", "0,0,0"}), HasSubstr("tick 31"));
  EXPECT_THAT(tessera({"force", "late", "--force", "0,0,5"}), HasSubstr("tick 31"));
  EXPECT_THAT(tessera({"find", "tower_1"}), HasSubstr("tower_1::box_1"));
  EXPECT_THAT(tessera({"raycast", "--at", "0,0,14", "--direction", "0,0,-1"}), HasSubstr("late"));
  EXPECT_THAT(tessera({"teleport", "late", "--at", "1,2,3", "--sector", "2,0,0"}), HasSubstr("tick 31"));
  EXPECT_THAT(tessera({"watch", "late", "--frames", "1"}), HasSubstr("30  body"));
  EXPECT_THAT(tessera({"status"}), HasSubstr("paused  seam, tick 30"));
  EXPECT_THAT(tessera({"hash"}), HasSubstr("at tick 30"));
  EXPECT_THAT(tessera({"resume", "--rtf", "0.5"}), HasSubstr("runs from"));
  EXPECT_THAT(tessera({"pause"}), HasSubstr("paused at"));
  EXPECT_THAT(tessera({"remove", "late"}), HasSubstr("takes effect"));
  const std::string walker = world_file("models/walker.sdf").string();
  EXPECT_THAT(tessera({"spawn", "--model", walker, "--name", "guard", "--at", "3,3,9"}),
              HasSubstr("model guard of 1 bodies"));
  EXPECT_THAT(tessera({"find", "guard"}), HasSubstr("guard::body"));
  EXPECT_THAT(tessera({"remove", "guard", "--model"}), HasSubstr("takes effect"));
  const Outcome neither = run_tessera({"spawn", "--name", "x"});
  EXPECT_EQ(neither.code, 2);
  EXPECT_THAT(neither.output, HasSubstr("--shape or --model is required"));
  const std::string module = world_file("programs/flee.wasm").string();
  const auto spawn_with = [&](const std::string& name, const std::string& program) {
    return tessera({"spawn", "--name", name, "--shape", "sphere:0.3", "--at", "0,0,9", "--program", program});
  };
  EXPECT_THAT(spawn_with("shy", module + ":radius=3"), HasSubstr("from tick"));
  EXPECT_THAT(spawn_with("too", "flee:radius=2"), HasSubstr("from tick")) << "the world has it now";
  tessera({"step", "2"});
  EXPECT_THAT(tessera({"programs"}),
              ::testing::AllOf(HasSubstr("shy"), HasSubstr("too"), HasSubstr("flee@")));
  tessera({"shutdown"});
  EXPECT_THAT(cluster.processes->wait_until_ended(kPatience), IsOk());
}

TEST(CommandLineTest, WhatAClusterRefusesIsSaidInTermsOfTheCommandLine) {
  cli::LocalClusterOptions options;
  options.join_timeout = absl::Seconds(1);
  const Cluster cluster = start_cluster(1, options);
  ASSERT_TRUE(cluster.client);
  const auto tessera = [&](std::vector<std::string> arguments) {
    arguments.push_back("--connect");
    arguments.push_back(cluster.processes->address());
    return run_tessera(arguments);
  };
  const std::string world = world_file("tower.sdf").string();
  EXPECT_EQ(tessera({"load", world}).code, 0);
  const Outcome again = tessera({"load", world});
  EXPECT_EQ(again.code, 1);
  EXPECT_THAT(again.output, HasSubstr("the world 'tower' is loaded; add --replace to replace it"));
  const Outcome told = tessera({"tell", "tower::box_8", "x=1"});
  EXPECT_EQ(told.code, 1);
  EXPECT_THAT(told.output, HasSubstr("body 'tower::box_8': it has no programs"));

  EXPECT_EQ(tessera({"unload"}).code, 0);
  for (const char* nobody : {"0", "2", "64"}) {
    const Outcome outcome = tessera({"drain", nobody});
    EXPECT_EQ(outcome.code, 1) << nobody;
    EXPECT_THAT(outcome.output, HasSubstr("must be a place from 1 to 1"));
  }
  for (const char* nobody : {"65", "a", "1234abcd"}) {
    const Outcome outcome = tessera({"drain", nobody});
    EXPECT_EQ(outcome.code, 1) << nobody;
    EXPECT_THAT(outcome.output, HasSubstr("is not a server of this cluster"));
  }
  const std::string node = absl::StrCat(absl::Hex(cluster.client->status().value().servers[0].node));
  const Outcome drained = tessera({"drain", "1"});
  EXPECT_EQ(drained.code, 0) << drained.output;
  EXPECT_THAT(drained.output, HasSubstr(absl::StrCat("server ", node, " is drained")));
  EXPECT_THAT(tessera({"load", world}).output,
              HasSubstr("but there are 0 after waiting for 1 s, and 1 that are drained"));
}

// Beside which stands nothing else: neither engines nor daemons.
TEST_F(RunTest, WhatIsNotBuiltIsNamedWithItsTarget) {
  const std::filesystem::path program = folder_ / "tessera";
  std::filesystem::copy_file(cli::executable_folder() / "tessera", program);
  const auto run_alone = [&](const std::vector<std::string>& arguments) {
    Process process(program.string(), arguments);
    EXPECT_EQ(process.wait(), 1) << arguments.front();
    return process.output();
  };
  const std::string world = world_file("tower.sdf").string();
  EXPECT_THAT(run_alone({"run", world, "--in-process", "--engine", "f64"}),
              HasSubstr("no physics engine of precision f64; in a clone, deploy/build.sh release "
                        "tessera-engine-f64 builds it"));
  EXPECT_THAT(run_alone({"up", "--listen", "127.0.0.1:0"}),
              HasSubstr("deploy/build.sh release tessera-coordinator builds it"));
  for (const char* daemon : {"tessera-coordinator", "tessera-sector-server"})
    std::filesystem::create_symlink(cli::executable_folder() / daemon, folder_ / daemon);
  EXPECT_THAT(run_alone({"up", "--listen", "127.0.0.1:0", "--no-page", "--gateway", "127.0.0.1:0"}),
              HasSubstr("deploy/build.sh release tessera-gateway builds it"));
  EXPECT_THAT(run_alone({"experiment"}), HasSubstr("deploy/build.sh release tessera-experiments builds it"));
}

TEST_F(RunTest, AStoreIsCheckedAndRepaired) {
  const std::string store = (folder_ / "store").string();
  EXPECT_THAT(run_tessera({"store", "check", store}).output, HasSubstr("there is no store"));
  {
    cli::LocalClusterOptions options;
    options.store_folder = store;
    options.checkpoint_every = absl::Seconds(60);
    const Cluster cluster = start_cluster(1, options);
    ASSERT_TRUE(cluster.client);
    ASSERT_TRUE(cluster.client->load(read_world("tower.sdf")).ok());
    EXPECT_THAT(run_tessera({"store", "check", store}).output, HasSubstr("uses this store"));
  }
  EXPECT_THAT(run_tessera({"store", "check", store}).output,
              AllOf(HasSubstr("'tower' at tick 0"), HasSubstr("as it was written")));
  for (const auto& file : std::filesystem::directory_iterator(store)) {
    if (file.path().extension() == ".mirror") std::filesystem::remove(file);
  }
  const Outcome damaged = run_tessera({"store", "check", store});
  EXPECT_EQ(damaged.code, 1);
  EXPECT_THAT(damaged.output,
              AllOf(HasSubstr("it is missing; its copy is whole"), HasSubstr("store repair")));
  EXPECT_EQ(run_tessera({"store", "repair", store}).code, 0);
  EXPECT_EQ(run_tessera({"store", "check", store}).code, 0);
}

TEST(CommandLineTest, AFileOfARequestIsAppliedOrRefusedWithTheReason) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  const auto apply = [&](const std::filesystem::path& file) {
    return run_tessera({"apply", file.string(), "--connect", cluster.processes->address()});
  };
  const std::filesystem::path folder = ::testing::TempDir();
  const std::filesystem::path file = folder / "tessera_request.json";
  const auto applied = [&](const std::string& text) {
    std::ofstream(file) << text;
    return apply(file);
  };
  ASSERT_TRUE(cluster.client->load(read_world("seam.sdf")).ok());
  const Outcome done =
      applied(R"({"commands": [{"applyRadialImpulse": {"centre": {}, "radius": 2}}], "ticks": 3,
                                   "queries": [{"hash": {}}]})");
  EXPECT_EQ(done.code, 0) << done.output;
  EXPECT_THAT(done.output, AllOf(HasSubstr("\"tick\": \"3\""), HasSubstr("hash")));
  EXPECT_THAT(applied(R"({"commands": [{}, {"remove": {"prefix": "nobody"}}]})").output,
              HasSubstr("commands[0]"));
  EXPECT_THAT(applied(R"({"comands": []})").output, AllOf(HasSubstr(file.string()), HasSubstr("comands")));
  EXPECT_THAT(apply(folder / "no_such_request.json").output, HasSubstr("No such file or directory"));
  EXPECT_EQ(apply(folder).code, 1);
  EXPECT_THAT(apply(folder).output, HasSubstr("Is a directory"));
}

// A cluster of two servers with a loaded world, shown by `tessera top`.
class TopTest : public RunTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(client().load(read_world("seam.sdf")).status(), IsOk());
    ASSERT_THAT(client().step(30, kPatience).status(), IsOk());
  }

  Client& client() { return *cluster_.client; }
  std::vector<std::string> top(std::vector<std::string> options) const {
    options.insert(options.begin(), "top");
    options.insert(options.end(), {"--connect", cluster_.processes->address()});
    return options;
  }

  Cluster cluster_ = start_cluster(2);
};

TEST_F(TopTest, LooksOnceForScripts) {
  const Outcome once = run_tessera(top({"--once"}));
  EXPECT_EQ(once.code, 0) << once.output;
  EXPECT_THAT(once.output, AllOf(HasSubstr("paused  seam, tick 30"), HasSubstr("\nserver "),
                                 HasSubstr("\nsector "), HasSubstr("(0, 0, 0)")));
  EXPECT_THAT(once.output, Not(HasSubstr("\033"))) << "no colours in a file";
  EXPECT_THAT(run_tessera(top({"--once", "--by", "sector"})).output, Not(HasSubstr("memory")));
  EXPECT_THAT(run_tessera(top({"--once", "--by", "server"})).output, Not(HasSubstr("(0, 0, 0)")));
}

TEST_F(TopTest, DataHasEveryBodyInItsSector) {
  const std::filesystem::path file = folder_ / "top.json";
  const Outcome once = run_tessera(top({"--once", "--sort", "clones", "--json", file.string()}));
  EXPECT_EQ(once.code, 0) << once.output;
  std::ifstream in(file);
  const nlohmann::json data = nlohmann::json::parse(in, nullptr, false);
  std::uint64_t awake = 0;
  std::uint64_t clones_before = std::numeric_limits<std::uint64_t>::max();
  std::set<std::string> servers;
  for (const nlohmann::json& sector : data["sectors_by_load"]) {
    awake += sector["bodies_awake"].get<std::uint64_t>();
    const auto clones = sector["clones"].get<std::uint64_t>();
    EXPECT_LE(clones, clones_before);
    clones_before = clones;
    servers.insert(sector["server"].get<std::string>());
  }
  EXPECT_GT(awake, 0);
  EXPECT_EQ(data["bodies_awake"], awake);
  EXPECT_EQ(data["servers"][0]["bodies_awake"].get<std::uint64_t>() +
                data["servers"][1]["bodies_awake"].get<std::uint64_t>(),
            awake);
  EXPECT_EQ(servers.size(), 2);
}

TEST_F(TopTest, LooksAgainAndAgainUntilItIsInterrupted) {
  Process live("tessera", top({"--period", "0.1s"}));
  ASSERT_TRUE(live.await_output("paused  seam, tick 30")) << live.output();
  ASSERT_THAT(client().step(1, kPatience).status(), IsOk());
  ASSERT_TRUE(live.await_output("\n\npaused  seam, tick 31")) << live.output();
  ASSERT_THAT(client().unload(), IsOk());
  ASSERT_TRUE(live.await_output("\n\nempty  no world")) << live.output();
  live.process().signal(SIGINT);
  EXPECT_EQ(live.wait(), kSignalled + SIGINT) << live.output();
}

TEST_F(TopTest, EndOfTheClusterIsAFailure) {
  Process live("tessera", top({"--period", "0.1s"}));
  ASSERT_TRUE(live.await_output("tick 30")) << live.output();
  ASSERT_THAT(client().shutdown(), IsOk());
  EXPECT_EQ(live.wait(), 1) << live.output();
  EXPECT_EQ(run_tessera(top({"--once"})).code, 1);
}

TEST(CommandLineTest, TopNamesWhatItCanBeSortedBy) {
  const Outcome sorted = run_tessera({"top", "--sort", "nonsense"});
  EXPECT_EQ(sorted.code, 2);
  EXPECT_THAT(sorted.output, AllOf(HasSubstr("nonsense"), HasSubstr("clones"), HasSubstr("memory")));
  EXPECT_EQ(run_tessera({"top", "--by", "body"}).code, 2);
  EXPECT_THAT(run_tessera({"top", "--period", "2h"}).output, HasSubstr("is not from 0.1 s to 3600 s"));
}

class HelloTest : public ::testing::TestWithParam<const char*> {};

TEST_P(HelloTest, RunsAgainstACluster) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(read_world("falling.sdf")).status(), IsOk());
  Process hello(GetParam(), {cluster.processes->address()});
  EXPECT_EQ(hello.wait(), 0) << hello.output();
  EXPECT_THAT(hello.output(), HasSubstr("60: "));
}

INSTANTIATE_TEST_SUITE_P(, HelloTest, ::testing::Values("tessera-hello", "tessera-hello-c"),
                         [](const auto& tested) { return tested.index == 0 ? "Cpp" : "C"; });

}  // namespace
}  // namespace tessera
