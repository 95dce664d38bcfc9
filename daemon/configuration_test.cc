#include "daemon/configuration.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>

#include "daemon/options.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

// A daemon called tessera-coordinator with two options of its own.
struct Daemon {
  Daemon() {
    app.add_option("--listen", listen, "Address for clients")->capture_default_str();
    app.add_option("--servers", servers, "How many")->check(CLI::Range(0, 64))->capture_default_str();
    app.add_flag("--exit-with-parent")->configurable(false);
    add_shared_options(app, dds, log, keys);
    read_configuration(app);
  }
  // What parsing throws, or nothing.
  std::string parse(std::vector<std::string> arguments) {
    std::reverse(arguments.begin(), arguments.end());
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError& error) {
      return error.what();
    }
    return "";
  }

  DdsOptions dds;
  LogOptions log;
  KeysOptions keys;
  std::string listen = "127.0.0.1:7300";
  int servers = 0;
  CLI::App app{"A daemon", "tessera-coordinator"};
};

class ConfigurationTest : public ::testing::Test {
 protected:
  std::vector<std::string> file(const std::string& text) {
    std::ofstream(path_) << text;
    return {"--config", path_};
  }
  void set(const char* variable, const char* value) {
    setenv(variable, value, 1);
    variables_.emplace_back(variable);
  }
  ~ConfigurationTest() override {
    std::remove(path_.c_str());
    for (const std::string& variable : variables_) unsetenv(variable.c_str());
  }

  // Each case may run in a process of its own, at the same time as others.
  const std::string path_ = absl::StrCat(::testing::TempDir(), "/configuration_test_", getpid(), ".toml");
  std::vector<std::string> variables_;
  Daemon daemon_;
};

constexpr const char* kFile = R"(
# shared by all
cluster = "lab"
log-level = "debug"
peers = ["10.0.0.1", "10.0.0.2"]

[coordinator]
listen = "0.0.0.0:7300"
servers = 2
log-level = "warn"   # of the coordinator alone

[sector-server]
listen = "10.0.0.1:7301"
)";

TEST_F(ConfigurationTest, OwnSectionGoesBeforeSharedKeys) {
  EXPECT_EQ(daemon_.parse(file(kFile)), "");
  EXPECT_EQ(daemon_.dds.cluster, "lab");
  EXPECT_THAT(daemon_.dds.network.peers, ::testing::ElementsAre("10.0.0.1", "10.0.0.2"));
  EXPECT_EQ(daemon_.log.level, "warn");
  EXPECT_EQ(daemon_.listen, "0.0.0.0:7300");
  EXPECT_EQ(daemon_.servers, 2);
}

TEST_F(ConfigurationTest, EnvironmentGoesBeforeFileAndCommandLineBeforeBoth) {
  set("TESSERA_COORDINATOR_SERVERS", "3");
  set("TESSERA_CLUSTER", "environment");
  set("TESSERA_LOG_LEVEL", "error");
  std::vector<std::string> arguments = file(kFile);
  arguments.insert(arguments.end(), {"--cluster", "flag"});
  EXPECT_EQ(daemon_.parse(arguments), "");
  EXPECT_EQ(daemon_.servers, 3);
  EXPECT_EQ(daemon_.dds.cluster, "flag");
  EXPECT_EQ(daemon_.log.level, "error");
  EXPECT_EQ(daemon_.listen, "0.0.0.0:7300");
}

TEST_F(ConfigurationTest, FileIsNamedByTheEnvironmentToo) {
  file(kFile);
  set("TESSERA_CONFIG", path_.c_str());
  Daemon daemon;
  EXPECT_EQ(daemon.parse({}), "");
  EXPECT_EQ(daemon.servers, 2);
  set("TESSERA_CONFIG", "/no/such/file.toml");
  Daemon lost;
  EXPECT_THAT(lost.parse({}), HasSubstr("/no/such/file.toml"));
}

TEST_F(ConfigurationTest, UnknownKeysAndSectionsAreNamed) {
  EXPECT_THAT(daemon_.parse(file("[coordinator]\nlisten-to = \"x\"\n")),
              ::testing::AllOf(HasSubstr(path_), HasSubstr("'listen-to'"), HasSubstr("[coordinator]"),
                               HasSubstr("servers")));
  EXPECT_THAT(Daemon().parse(file("clutser = \"x\"\n")), HasSubstr("'clutser'"));
  EXPECT_THAT(Daemon().parse(file("[viewer]\nport = 1\n")), HasSubstr("[viewer]"));
  EXPECT_THAT(Daemon().parse(file("[coordinators]\n")), HasSubstr("[coordinators]"));
  // A key of one daemon has no place before the sections; what is for the command line alone has none at all.
  EXPECT_THAT(Daemon().parse(file("servers = 2\n")), HasSubstr("'servers'"));
  EXPECT_THAT(Daemon().parse(file("[coordinator]\nexit-with-parent = true\n")),
              HasSubstr("'exit-with-parent'"));
}

TEST_F(ConfigurationTest, BadValuesAreRefused) {
  EXPECT_THAT(daemon_.parse(file("[coordinator]\nservers = 65\n")), HasSubstr("servers"));
  EXPECT_THAT(Daemon().parse(file("log-format = \"xml\"\n")), HasSubstr("log-format"));
  EXPECT_THAT(Daemon().parse({"--config", "/no/such/file.toml"}), HasSubstr("/no/such/file.toml"));
}

TEST_F(ConfigurationTest, TextSaysWhatIsSetAndReadsBack) {
  EXPECT_EQ(daemon_.parse(file(kFile)), "");
  const std::string text = configuration_text({&daemon_.app});
  EXPECT_THAT(text, HasSubstr("# Name of the cluster\n# (--cluster, TESSERA_CLUSTER)\ncluster = \"lab\"\n"));
  EXPECT_THAT(text, HasSubstr("\n#domain = 0\n"));
  EXPECT_THAT(text, HasSubstr("\n[coordinator]\n"));
  EXPECT_THAT(text, HasSubstr("# (--servers, TESSERA_COORDINATOR_SERVERS)\nservers = 2\n"));
  Daemon again;
  EXPECT_EQ(again.parse(file(text)), "");
  EXPECT_EQ(configuration_text({&again.app}), text);
}

}  // namespace
}  // namespace tessera
