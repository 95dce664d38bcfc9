// Checks the files of deploy/ against the daemons: options, variables, ports, names.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>

#include "coordinator/options.h"
#include "daemon/configuration.h"
#include "gateway/options.h"
#include "keys/keys_folder.h"
#include "sector_server/options.h"

namespace tessera {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

std::filesystem::path deploy(const std::string& file) {
  return std::filesystem::path(TESSERA_SOURCE) / "deploy" / file;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  EXPECT_TRUE(in.good()) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

// The options of the daemons, without running them.
struct Daemons {
  Daemons() {
    add_options(coordinator, coordinator_arguments);
    add_options(sector_server, server_arguments);
    add_options(gateway, gateway_arguments);
    for (CLI::App* app : {&coordinator, &sector_server, &gateway}) read_configuration(*app);
  }
  void parse(const std::string& file = "") {
    for (CLI::App* app : {&coordinator, &sector_server, &gateway}) {
      std::vector<std::string> arguments;
      if (!file.empty()) arguments = {file, "--config"};
      EXPECT_NO_THROW(app->parse(arguments)) << file;
    }
  }
  const CLI::App& named(const std::string& program) const {
    if (program == kGatewayName) return gateway;
    return program == kCoordinatorName ? coordinator : sector_server;
  }
  const std::string& metrics_of(const std::string& program) const {
    if (program == kGatewayName) return gateway_arguments.metrics_address;
    return program == kCoordinatorName ? coordinator_arguments.metrics_address
                                       : server_arguments.metrics_address;
  }
  std::set<std::string> variables() const {
    std::set<std::string> names = {"TESSERA_CONFIG"};
    for (const CLI::App* app : {&coordinator, &sector_server, &gateway}) {
      for (const CLI::Option* option : app->get_options()) names.insert(option->get_envname());
    }
    return names;
  }

  CoordinatorArguments coordinator_arguments;
  SectorServerArguments server_arguments;
  CLI::App coordinator{"", kCoordinatorName};
  CLI::App sector_server{"", kSectorServerName};
  GatewayArguments gateway_arguments;
  CLI::App gateway{"", kGatewayName};
};

// The options among `words` that follow the name of a daemon.
void expect_known_options(const std::string& text) {
  const Daemons daemons;
  static const std::regex call("(tessera-coordinator|tessera-sector-server|tessera-gateway)\\b([^\n]*)");
  static const std::regex option("--[a-z-]+");
  for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) {
    const std::string program = (*it)[1];
    const std::string rest = (*it)[2];
    for (std::sregex_iterator flag(rest.begin(), rest.end(), option); flag != end; ++flag) {
      EXPECT_NE(daemons.named(program).get_option_no_throw(flag->str()), nullptr)
          << program << " " << flag->str();
    }
  }
}

void expect_known_variables(const std::string& text) {
  static const std::regex variable("TESSERA_[A-Z_]+");
  const std::set<std::string> known = Daemons().variables();
  for (std::sregex_iterator it(text.begin(), text.end(), variable), end; it != end; ++it) {
    EXPECT_THAT(known, Contains(it->str()));
  }
}

TEST(ConfigurationFileTest, IsWhatConfigShowPrints) {
  Daemons daemons;
  daemons.parse();
  EXPECT_EQ(text_of(deploy("tessera.toml")),
            configuration_text({&daemons.coordinator, &daemons.sector_server, &daemons.gateway}))
      << "update it: tessera config show >deploy/tessera.toml";
}

TEST(ConfigurationFileTest, WithEveryKeySetSaysTheSame) {
  const std::string path = absl::StrCat(::testing::TempDir(), "/every_key_", getpid(), ".toml");
  std::ofstream(path) << std::regex_replace(text_of(deploy("tessera.toml")), std::regex("\n#([a-z])"),
                                            "\n$1");
  Daemons set;
  set.parse(path);
  const Daemons untouched;
  EXPECT_EQ(set.coordinator_arguments.dds.cluster, untouched.coordinator_arguments.dds.cluster);
  EXPECT_EQ(set.coordinator_arguments.dds.network.peers, untouched.coordinator_arguments.dds.network.peers);
  EXPECT_EQ(set.coordinator_arguments.listen, untouched.coordinator_arguments.listen);
  EXPECT_EQ(set.coordinator_arguments.metrics_address, "");
  EXPECT_EQ(set.coordinator_arguments.coordinator.server_timeout,
            untouched.coordinator_arguments.coordinator.server_timeout);
  EXPECT_EQ(set.server_arguments.server.threads, untouched.server_arguments.server.threads);
  EXPECT_EQ(set.server_arguments.server.precision, untouched.server_arguments.server.precision);
  std::filesystem::remove(path);
}

TEST(UnitsTest, KnowTheOptions) {
  for (const char* unit : {"systemd/tessera-coordinator.service", "systemd/tessera-gateway.service",
                           "systemd/tessera-sector-server@.service"}) {
    const std::string text = text_of(deploy(unit));
    expect_known_options(text);
    EXPECT_THAT(text, HasSubstr("--config /etc/tessera/tessera.toml"));
    EXPECT_THAT(text, HasSubstr("DynamicUser=yes"));
  }
  EXPECT_EQ(text_of(deploy("debian/conffiles")), "/etc/tessera/tessera.toml\n");
}

TEST(UnitsTest, GetEveryFileOfTheKeys) {
  const std::string text = text_of(deploy("keys.conf"));
  for (const char* file :
       {kAuthorityFile, kCertificateFile, kKeyFile, kTokensFile, kGovernanceFile, kPermissionsFile}) {
    EXPECT_THAT(text, HasSubstr(absl::StrCat("LoadCredential=", file, ":/etc/tessera/keys/", file, "\n")));
  }
  expect_known_variables(text);
}

TEST(ScriptsTest, KnowTheOptions) {
  for (const char* script : {"network_namespaces.sh", "try_package.sh", "Containerfile"}) {
    expect_known_options(text_of(deploy(script)));
  }
}

TEST(ComposeTest, ServicesKnowTheOptionsAndOneAnother) {
  const std::string text = text_of(deploy("compose.yaml"));
  expect_known_options(text);
  expect_known_variables(text);
  const YAML::Node compose = YAML::Load(text);
  for (const char* service : {"coordinator", "sector-server", "gateway", "prometheus", "grafana"}) {
    ASSERT_TRUE(compose["services"][service]) << service;
  }
  const std::string peers = compose["x-daemon"]["environment"]["TESSERA_PEERS"].as<std::string>();
  for (const char* service : {"coordinator", "sector-server"}) {
    const YAML::Node aliases = compose["services"][service]["networks"]["cluster"]["aliases"];
    EXPECT_THAT(peers, HasSubstr(aliases[0].as<std::string>()));
    EXPECT_THAT(text_of(deploy("prometheus.yml")), HasSubstr(aliases[0].as<std::string>()));
  }
  YAML::Load(text_of(deploy("prometheus.yml")));
  for (const char* file : {"datasource.yaml", "dashboards.yaml"}) {
    EXPECT_EQ(YAML::Load(text_of(deploy(absl::StrCat("grafana/", file))))["apiVersion"].as<int>(), 1);
  }
}

class KubernetesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const YAML::Node kustomization = YAML::Load(text_of(deploy("kubernetes/kustomization.yaml")));
    for (const YAML::Node& file : kustomization["resources"]) {
      for (const YAML::Node& object :
           YAML::LoadAll(text_of(deploy("kubernetes/" + file.as<std::string>())))) {
        objects_[object["kind"].as<std::string>()][object["metadata"]["name"].as<std::string>()] = object;
      }
    }
  }
  // The coordinator, the sector servers and the gateways.
  std::vector<YAML::Node> workloads() {
    return {objects_["Deployment"]["tessera-coordinator"], objects_["StatefulSet"]["tessera-sector-server"],
            objects_["Deployment"]["tessera-gateway"]};
  }
  static std::map<std::string, int> ports_of(const YAML::Node& container) {
    std::map<std::string, int> ports;
    for (const YAML::Node& port : container["ports"]) {
      ports[port["name"].as<std::string>()] = port["containerPort"].as<int>();
    }
    return ports;
  }

  std::map<std::string, std::map<std::string, YAML::Node>> objects_;
};

TEST_F(KubernetesTest, WorkloadsRunDaemonsThatAreProbedWhereTheyServe) {
  Daemons daemons;
  daemons.parse(deploy("kubernetes/tessera.toml"));
  for (const YAML::Node& workload : workloads()) {
    const YAML::Node pod = workload["spec"]["template"];
    EXPECT_EQ(workload["spec"]["selector"]["matchLabels"]["app"].as<std::string>(),
              pod["metadata"]["labels"]["app"].as<std::string>());
    const YAML::Node container = pod["spec"]["containers"][0];
    const std::string program = container["command"][0].as<std::string>();
    for (const YAML::Node& word : container["command"]) {
      const std::string option = word.as<std::string>();
      if (absl::StartsWith(option, "--")) {
        EXPECT_NE(daemons.named(program).get_option_no_throw(option), nullptr) << option;
      }
    }
    EXPECT_EQ(daemons.metrics_of(program), absl::StrCat("0.0.0.0:", ports_of(container)["metrics"]));
    for (const auto& [probe, path] :
         {std::pair("readinessProbe", "/readyz"), std::pair("livenessProbe", "/healthz")}) {
      EXPECT_EQ(container[probe]["httpGet"]["path"].as<std::string>(), path);
      EXPECT_EQ(container[probe]["httpGet"]["port"].as<std::string>(), "metrics");
      EXPECT_EQ(container[probe]["httpGet"]["scheme"].as<std::string>(), "HTTPS");
    }
    EXPECT_TRUE(container["resources"]["requests"]["memory"]);
    expect_known_variables(YAML::Dump(container));
  }
}

// "8Gi" in bytes.
std::size_t memory_limit(const YAML::Node& workload) {
  const std::string limit =
      workload["spec"]["template"]["spec"]["containers"][0]["resources"]["limits"]["memory"]
          .as<std::string>();
  EXPECT_TRUE(absl::EndsWith(limit, "Gi")) << limit;
  return static_cast<std::size_t>(std::stoi(limit)) << 30;
}

// By the factors that docs/sizing.md has measured.
TEST_F(KubernetesTest, PodsHaveTheMemoryThatTheLimitsOfShapesAllow) {
  constexpr std::size_t kOfServer = 16;
  constexpr std::size_t kOfCoordinator = 6;
  constexpr std::size_t kWithoutShapes = std::size_t{512} << 20;
  Daemons daemons;
  daemons.parse(deploy("kubernetes/tessera.toml"));
  const CoordinatorArguments& coordinator = daemons.coordinator_arguments;
  const std::size_t shapes = coordinator.coordinator.shape_bytes_max;
  EXPECT_LE(kOfCoordinator * shapes + coordinator.queued_request_bytes_max + kWithoutShapes,
            memory_limit(workloads()[0]));
  EXPECT_LE(kOfServer * shapes + kWithoutShapes, memory_limit(workloads()[1]));
}

TEST_F(KubernetesTest, DaemonsHaveKeysFromASecret) {
  Daemons daemons;
  daemons.parse(deploy("kubernetes/tessera.toml"));
  EXPECT_FALSE(daemons.coordinator_arguments.keys.insecure || daemons.server_arguments.keys.insecure);
  const std::string create = text_of(deploy("kubernetes/kustomization.yaml"));
  for (const YAML::Node& workload : workloads()) {
    const YAML::Node pod = workload["spec"]["template"]["spec"];
    std::map<std::string, YAML::Node> volumes;
    for (const YAML::Node& volume : pod["volumes"]) volumes.emplace(volume["name"].as<std::string>(), volume);
    bool has_keys = false;
    for (const YAML::Node& mount : pod["containers"][0]["volumeMounts"]) {
      if (mount["mountPath"].as<std::string>() != daemons.coordinator_arguments.keys.folder) continue;
      has_keys = true;
      const std::string secret =
          volumes.at(mount["name"].as<std::string>())["secret"]["secretName"].as<std::string>();
      const char* folder = secret == "tessera-gateway-keys" ? kGatewayFolder : kDaemonFolder;
      EXPECT_THAT(create,
                  HasSubstr(absl::StrCat("create secret generic ", secret, " --from-file=keys/", folder)));
    }
    EXPECT_TRUE(has_keys);
  }
}

TEST_F(KubernetesTest, ThePolicyClosesThePodsButForTheirPorts) {
  const YAML::Node spec = objects_["NetworkPolicy"]["tessera-daemons"]["spec"];
  std::set<std::string> ports;
  std::vector<YAML::Node> closed = workloads();
  closed.pop_back();  // gateways are open
  for (const YAML::Node& workload : closed) {
    const YAML::Node pod = workload["spec"]["template"];
    EXPECT_THAT(spec["podSelector"]["matchExpressions"][0]["values"].as<std::vector<std::string>>(),
                Contains(pod["metadata"]["labels"]["app"].as<std::string>()));
    for (const auto& [name, number] : ports_of(pod["spec"]["containers"][0])) ports.insert(name);
  }
  EXPECT_EQ(spec["policyTypes"].as<std::vector<std::string>>(), std::vector<std::string>{"Ingress"});
  for (const YAML::Node& rule : spec["ingress"]) {
    EXPECT_TRUE(rule["from"]) << "open to everyone";
    for (const YAML::Node& port : rule["ports"]) {
      if (port["protocol"].as<std::string>() == "TCP") {
        EXPECT_THAT(ports, Contains(port["port"].as<std::string>()));
      }
    }
  }
}

TEST_F(KubernetesTest, ServicesLeadToPods) {
  std::map<std::string, std::map<std::string, int>> ports_by_app;
  for (const YAML::Node& workload : workloads()) {
    const YAML::Node pod = workload["spec"]["template"];
    ports_by_app[pod["metadata"]["labels"]["app"].as<std::string>()] = ports_of(pod["spec"]["containers"][0]);
  }
  for (const auto& [name, service] : objects_["Service"]) {
    const std::string app = service["spec"]["selector"]["app"].as<std::string>();
    for (const YAML::Node& port : service["spec"]["ports"]) {
      EXPECT_TRUE(ports_by_app[app].contains(port["targetPort"].as<std::string>())) << name;
    }
  }
  EXPECT_TRUE(objects_["Service"].contains(workloads()[1]["spec"]["serviceName"].as<std::string>()));
}

TEST_F(KubernetesTest, ConfigurationFitsTheManifests) {
  Daemons daemons;
  daemons.parse(deploy("kubernetes/tessera.toml"));
  for (const std::string& peer : daemons.server_arguments.dds.network.peers) {
    ASSERT_TRUE(objects_["Service"].contains(peer)) << peer;
    const YAML::Node spec = objects_["Service"][peer]["spec"];
    EXPECT_EQ(spec["clusterIP"].as<std::string>(), "None") << "a peer's name must stand for pods";
    EXPECT_TRUE(spec["publishNotReadyAddresses"].as<bool>());
  }
  EXPECT_EQ(workloads()[1]["spec"]["replicas"].as<std::uint32_t>(),
            daemons.coordinator_arguments.coordinator.servers_wanted);
  EXPECT_EQ(
      workloads()[1]["spec"]["template"]["spec"]["containers"][0]["resources"]["limits"]["cpu"].as<int>(),
      daemons.server_arguments.server.threads);
}

}  // namespace
}  // namespace tessera
