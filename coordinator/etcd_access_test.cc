#include "coordinator/etcd_access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "keys/test_keys.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

CoordinatorArguments of(std::vector<std::string> urls) {
  CoordinatorArguments arguments;
  arguments.etcd = std::move(urls);
  return arguments;
}

std::string why_not(const CoordinatorArguments& arguments) {
  const absl::StatusOr<EtcdAccess> access = etcd_access(arguments, std::nullopt);
  EXPECT_FALSE(access.ok());
  return std::string(access.status().message());
}

TEST(EtcdAccessTest, ReadsUrlsOfMembers) {
  const EtcdAccess access =
      etcd_access(of({"http://127.0.0.1:2379/", "localhost:2380", "https://[2001:db8::1]:2379"}),
                  std::nullopt)
          .value();
  ASSERT_EQ(access.members.size(), 3u);
  EXPECT_EQ(access.members[0].address, "127.0.0.1:2379");
  EXPECT_EQ(access.members[1].address, "localhost:2380");
  EXPECT_EQ(access.members[2].address, "[2001:db8::1]:2379");
  EXPECT_FALSE(access.members[0].has_tls || access.members[1].has_tls);
  EXPECT_TRUE(access.members[2].has_tls);
  EXPECT_TRUE(access.authority.empty() && access.certificate.empty());
  for (const char* url : {"https://", "ftp://127.0.0.1:1", "127.0.0.1", "http://127.0.0.1:99999"})
    EXPECT_THAT(why_not(of({url})), HasSubstr(url));
}

TEST(EtcdAccessTest, WithoutTlsOnlyLoopbackIsReachedUnlessThatIsWanted) {
  CoordinatorArguments arguments = of({"http://127.0.0.1:2379", "http://10.0.0.1:2379"});
  EXPECT_THAT(why_not(arguments), HasSubstr("https://10.0.0.1:2379"));
  const TestKeys keys;
  EXPECT_FALSE(etcd_access(arguments, read_server_keys(keys.folder(), "daemon").value()).ok());
  arguments.keys.insecure = true;
  EXPECT_TRUE(etcd_access(arguments, std::nullopt).ok());
}

TEST(EtcdAccessTest, KeysOfTheClusterAreShownUnlessOthersAreNamed) {
  const TestKeys keys;
  const ServerKeys daemon = read_server_keys(keys.folder(), "daemon").value();
  CoordinatorArguments arguments = of({"https://10.0.0.1:2379"});
  EtcdAccess access = etcd_access(arguments, daemon).value();
  EXPECT_EQ(access.authority, daemon.authority);
  EXPECT_EQ(access.certificate, daemon.certificate);
  EXPECT_EQ(access.key, daemon.key);

  const std::filesystem::path others = keys.folder() / "admin";
  arguments.etcd_files.certificate = (others / "certificate.pem").string();
  arguments.etcd_files.key = (others / "key.pem").string();
  access = etcd_access(arguments, daemon).value();
  EXPECT_EQ(access.authority, "") << "one that the machine trusts";
  EXPECT_NE(access.certificate, daemon.certificate);
  EXPECT_THAT(access.key, HasSubstr("PRIVATE KEY"));
}

TEST(EtcdAccessTest, FilesThatAreOfNoUseAreRefused) {
  CoordinatorArguments arguments = of({"https://10.0.0.1:2379"});
  arguments.etcd_files.certificate = "/certificate.pem";
  EXPECT_THAT(why_not(arguments), HasSubstr("--etcd-certificate and --etcd-key go together"));
  arguments.etcd_files = {.authority = "/not/there.pem", .certificate = {}, .key = {}};
  EXPECT_THAT(why_not(arguments), HasSubstr("--etcd-ca: /not/there.pem is missing"));
  arguments.etcd = {"http://127.0.0.1:2379"};
  EXPECT_THAT(why_not(arguments), HasSubstr("https://"));
}

}  // namespace
}  // namespace tessera
