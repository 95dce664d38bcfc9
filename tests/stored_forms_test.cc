// What earlier versions have stored goes on (tests/golden/stored): with the bits that it would have had,
// where physics has not changed since.
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;

struct Stored {
  const char* version;
  Precision precision;
  // At tick 90.
  const char* hash;           // from the snapshot, of tick 80
  const char* hash_of_store;  // from the store, whose state is of an earlier tick; empty: there is none
  bool has_hashes_of_today = false;  // of bodies and of programs, where it was recorded
};

void PrintTo(const Stored& stored, std::ostream* out) { *out << stored.version << name_of(stored.precision); }

const Stored kStored[] = {
    {"4", Precision::kFloat32, "4da0ebd25221a5b157ad16d5c59fb24b", "6dc01383fa983226a4f05cca12694c8d"},
    {"4", Precision::kFloat64, "d327e18c421286d68387bf5a0636edf0", ""},
    {"5", Precision::kFloat32, "1de5390f6b47291b7c0e896d2883e2ac", "0cc0051121c648a37ec6176928977c33"},
    {"5", Precision::kFloat64, "8c76839e54ee0dfe6a34d7f9bf6eabe8", ""},
    {"6", Precision::kFloat32, "5b73bf26d7670e2e62cb44fd1fead5d5", "5b73bf26d7670e2e62cb44fd1fead5d5"},
    {"6", Precision::kFloat64, "edfb74f89b117da60fb4157bdb05ecbf", ""},
    {"7", Precision::kFloat32, "79b9f47e45926a4ec75336603c318749", "79b9f47e45926a4ec75336603c318749", true},
    {"7", Precision::kFloat64, "2f2bdabe41dc99f2ceda28e17438847a", "", true}};

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

// Until they differ, where physics, or the numbers of a kind of program, have changed since they were
// recorded.
TEST_P(StoredFormsTest, RecordingsAreReplayed) {
  const std::filesystem::path file = stored_file(GetParam(), "recording");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "of f32 only";
  EXPECT_THAT(run_tessera({"replay", file.string()}).output,
              HasSubstr(GetParam().has_hashes_of_today ? "the same hash at all 90" : "when it was recorded"));
}

TEST_P(StoredFormsTest, StoresGoOn) {
  const std::filesystem::path folder = stored_file(GetParam(), "store");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "of f32 only";
  ASSERT_STRNE(GetParam().hash_of_store, "");
  const std::filesystem::path copy = cli::make_temporary_folder().value();
  std::filesystem::copy(folder, copy, std::filesystem::copy_options::recursive);
  {
    cli::LocalClusterOptions options;
    options.checkpoint_every = absl::Seconds(60);
    options.store_folder = copy;
    const Cluster cluster = cluster_of(GetParam(), options);
    ASSERT_TRUE(cluster.client);
    EXPECT_EQ(hash_at_90(*cluster.client), GetParam().hash_of_store);
  }
  std::filesystem::remove_all(copy);
}

INSTANTIATE_TEST_SUITE_P(, StoredFormsTest, ::testing::ValuesIn(kStored), [](const auto& test) {
  return absl::StrCat("version_", test.param.version, "_", name_of(test.param.precision));
});

}  // namespace
}  // namespace tessera
