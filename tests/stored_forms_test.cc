// What earlier versions have stored goes on with the bits that it would have had (tests/golden/stored).
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

struct Stored {
  const char* version;
  Precision precision;
  const char* hash;  // at tick 90
};

void PrintTo(const Stored& stored, std::ostream* out) { *out << stored.version << name_of(stored.precision); }

const Stored kStored[] = {{"4", Precision::kFloat32, "87e67d3dcf670de8f9e794de53d3e02b"},
                          {"4", Precision::kFloat64, "955f37aa83f42814ae89e2250ad4a7cc"},
                          {"5", Precision::kFloat32, "88544230bd13a59947571fc4cc051def"},
                          {"5", Precision::kFloat64, "0a474deff2a90d319d0675294ab8a352"}};

std::filesystem::path stored_file(const Stored& stored, const char* kind) {
  return std::filesystem::path(TESSERA_STORED) / stored.version /
         absl::StrCat(name_of(stored.precision), ".", kind);
}

Cluster cluster_of(const Stored& stored, cli::LocalClusterOptions options = {}) {
  options.precision = stored.precision;
  return start_cluster(2, options);
}

// A hash is that of the last tick that is certain to run.
std::string hash_at_90(Client& client) {
  absl::StatusOr<HashAt> hash = client.hash();
  if (hash.ok() && hash->tick < 90) {
    EXPECT_THAT(client.step(90 - hash->tick).status(), IsOk());
    hash = client.hash();
  }
  EXPECT_THAT(hash.status(), IsOk());
  return hash.ok() ? hash->hash : "";
}

class StoredFormsTest : public ::testing::TestWithParam<Stored> {};

TEST_P(StoredFormsTest, SnapshotsGoOn) {
  const Cluster cluster = cluster_of(GetParam());
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->restore(stored_file(GetParam(), "snapshot")).status(), IsOk());
  EXPECT_EQ(hash_at_90(*cluster.client), GetParam().hash);
}

TEST_P(StoredFormsTest, RecordingsAreReplayed) {
  const std::filesystem::path file = stored_file(GetParam(), "recording");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "of f32 only";
  EXPECT_THAT(run_tessera({"replay", file.string()}).output, HasSubstr("the same hash at all 90"));
}

TEST_P(StoredFormsTest, StoresGoOn) {
  const std::filesystem::path folder = stored_file(GetParam(), "store");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "of f32 only";
  const std::filesystem::path copy = cli::make_temporary_folder().value();
  std::filesystem::copy(folder, copy, std::filesystem::copy_options::recursive);
  {
    cli::LocalClusterOptions options;
    options.checkpoint_every = absl::Seconds(60);
    options.store_folder = copy;
    const Cluster cluster = cluster_of(GetParam(), options);
    ASSERT_TRUE(cluster.client);
    EXPECT_EQ(hash_at_90(*cluster.client), GetParam().hash);
  }
  std::filesystem::remove_all(copy);
}

INSTANTIATE_TEST_SUITE_P(, StoredFormsTest, ::testing::ValuesIn(kStored), [](const auto& test) {
  return absl::StrCat("version_", test.param.version, "_", name_of(test.param.precision));
});

}  // namespace
}  // namespace tessera
