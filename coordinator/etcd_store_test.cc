// A store in etcd is read by the leader that comes next, on whatever host, as the one before left it.
#include "coordinator/etcd_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <random>

#include "coordinator/fake_etcd.h"
#include "coordinator/test_cluster.h"
#include "coordinator/test_store.h"
#include "proto/snapshot.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using testing::FakeEtcd;

class EtcdStoreTest : public ::testing::Test {
 protected:
  EtcdStoreTest() : path_(::testing::TempDir() + "tessera_etcd_store_" + std::to_string(getpid())) {
    std::filesystem::remove_all(path_);
    folder_ = *StateFolder::open(path_);
  }
  ~EtcdStoreTest() override { std::filesystem::remove_all(path_); }

  // Another leader, while there may still be one.
  std::unique_ptr<EtcdStore> lead() {
    etcdserverpb::TxnRequest request;
    *request.add_success() = erase(keys_.leader);
    etcd_.transact(request).wait();
    request.clear_success();
    *request.add_success() = put(keys_.leader, "somebody");
    const std::int64_t epoch = etcd_.transact(request).get()->header().revision();
    EtcdStore::Options options;
    options.epoch = epoch;
    options.leads = [] { return true; };
    options.copies.offer = [this](const std::string& recorded, const std::string& next) {
      offers_.emplace_back(recorded, next);
    };
    options.copies.holders = [this](const std::string&) { return holders_; };
    absl::StatusOr<std::unique_ptr<EtcdStore>> store = EtcdStore::open(etcd_, keys_, *folder_, options);
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }

  static void settle(EtcdStore& store) {
    for (int n = 0; n < 100 && store.stored() < store.position() && !store.lost(); ++n)
      store.tend().IgnoreError();
  }
  // Until the state that is being written is recorded.
  void record(EtcdStore& store) {
    const std::size_t before = offers_.size();
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::chrono::steady_clock::now() < deadline && !store.lost()) {
      store.tend().IgnoreError();
      if (offers_.size() >= before + 2 && offers_.back().second.empty()) return;
    }
  }

  const EtcdKeys keys_{"lab"};
  FakeEtcd etcd_;
  std::filesystem::path path_;
  std::unique_ptr<StateFolder> folder_;
  std::optional<std::vector<std::string>> holders_ = std::vector<std::string>();
  std::vector<std::pair<std::string, std::string>> offers_;
};

TEST_F(EtcdStoreTest, IsEmptyAtFirstAndAfterTheEndOfItsWorld) {
  EXPECT_EQ(lead()->take_stored(), std::nullopt);
  {
    const auto store = lead();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    ASSERT_TRUE(store->append({stored_removal(1)}).ok());
    ASSERT_TRUE(store->end().ok());
  }
  EXPECT_EQ(lead()->take_stored(), std::nullopt);
  EXPECT_EQ(etcd_.keys(), 1u) << "the leader";
}

TEST_F(EtcdStoreTest, HasTheWorldAndItsInputsInOrder) {
  {
    const auto store = lead();
    ASSERT_TRUE(store->begin(7, to_proto(small_world())).ok());
    for (Tick tick = 1; tick <= 200; ++tick) {
      ASSERT_TRUE(store->append({stored_removal(2 * tick - 1), stored_removal(2 * tick)}).ok());
    }
    settle(*store);
    EXPECT_EQ(store->stored(), 400u);
  }
  const auto world = lead()->take_stored();
  ASSERT_TRUE(world);
  EXPECT_EQ(world->load, 7u);
  EXPECT_EQ(std::get<v1::World>(world->state).SerializeAsString(),
            to_proto(small_world()).SerializeAsString());
  std::vector<Tick> all(400);
  std::iota(all.begin(), all.end(), 1);
  EXPECT_EQ(ticks_of(world), all);
}

TEST_F(EtcdStoreTest, InputsAreToldOnlyOnceEtcdHasThem) {
  const auto store = lead();
  ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
  etcd_.answers = false;
  ASSERT_TRUE(store->append({stored_removal(1)}).ok());
  for (int n = 0; n < 10; ++n) ASSERT_TRUE(store->tend().ok());
  EXPECT_EQ(store->stored(), 0u);
  etcd_.answers = true;
  settle(*store);
  EXPECT_EQ(store->stored(), 1u);
}

TEST_F(EtcdStoreTest, AStateTakesThePlaceOfTheInputsThatItHas) {
  {
    const auto store = lead();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    for (Tick tick = 1; tick <= 5; ++tick) ASSERT_TRUE(store->append({stored_removal(tick)}).ok());
    ASSERT_TRUE(store->change(state_of(3), 3));
    EXPECT_FALSE(store->change(state_of(4), 4)) << "one at a time";
    ASSERT_TRUE(store->append({stored_removal(6)}).ok());
    record(*store);
    settle(*store);
  }
  const auto world = lead()->take_stored();
  ASSERT_TRUE(world);
  EXPECT_EQ(std::get<SnapshotChunks>(world->state).front().head().tick(), 3u);
  EXPECT_THAT(ticks_of(world), ElementsAre(4, 5, 6));
  EXPECT_EQ(folder_->files().size(), 1u);
}

TEST_F(EtcdStoreTest, AStateMayBeSeveralFiles) {
  {
    const auto store = lead();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    EXPECT_TRUE(store->wants_whole());
    StateChange whole = state_of(1);
    put(sector_chunk(5, std::string(100'000, 'a')), whole.chunks);
    ASSERT_TRUE(store->change(whole, 0));
    EXPECT_FALSE(store->wants_whole());
    record(*store);
    for (Tick tick = 2; tick < 6; ++tick) {
      StateChange change = state_of(tick);
      change.is_whole = false;
      ASSERT_TRUE(store->change(change, 0));
      record(*store);
    }
    EXPECT_EQ(folder_->files().size(), 2u);
  }
  const auto store = lead();
  const auto world = store->take_stored();
  ASSERT_TRUE(world);
  const auto& chunks = std::get<SnapshotChunks>(world->state);
  ASSERT_EQ(chunks.size(), 3u);
  EXPECT_EQ(chunks[0].head().tick(), 5u);
  EXPECT_EQ(chunks[1].sectors().size(), 100'000u);
  EXPECT_TRUE(store->wants_whole());
}

TEST_F(EtcdStoreTest, AStateIsRecordedOnceTheStandbysHaveIt) {
  const auto store = lead();
  ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
  holders_.reset();
  ASSERT_TRUE(store->append({stored_removal(1)}).ok());
  ASSERT_TRUE(store->change(state_of(1), 1));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (offers_.back().second.empty() && std::chrono::steady_clock::now() < deadline)
    store->tend().IgnoreError();
  for (int n = 0; n < 10; ++n) store->tend().IgnoreError();
  EXPECT_EQ(etcd_.keys_with(keys_.inputs), 1u);
  holders_ = {"other"};
  for (int n = 0; n < 10; ++n) store->tend().IgnoreError();
  EXPECT_EQ(etcd_.keys_with(keys_.inputs), 0u);
}

TEST_F(EtcdStoreTest, ALargeInputTravelsInPiecesAndCountsAsAWhole) {
  v1::StoredInput large = stored_removal(2);
  large.mutable_commands()->mutable_commands(0)->mutable_remove()->mutable_body()->set_name(
      std::string(5 * kEtcdValueBytesMax, 'x'));
  {
    const auto store = lead();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    ASSERT_TRUE(store->append({stored_removal(1)}).ok());
    settle(*store);
    ASSERT_TRUE(store->append({large, stored_removal(3)}).ok());
    for (int n = 0; n < 4; ++n) store->tend().IgnoreError();  // and then it is lost
    EXPECT_EQ(store->stored(), 1u);
  }
  {
    const auto store = lead();
    EXPECT_THAT(ticks_of(store->take_stored()), ElementsAre(1));
    ASSERT_TRUE(store->append({large, stored_removal(4)}).ok());
    settle(*store);
    EXPECT_EQ(store->stored(), 3u);
  }
  EXPECT_THAT(ticks_of(lead()->take_stored()), ElementsAre(1, 2, 4));
  EXPECT_LT(etcd_.largest_request, std::size_t{3} << 19) << "etcd refuses what is larger";
}

TEST_F(EtcdStoreTest, OneThatDoesNotLeadAnyMoreChangesNothing) {
  const auto old = lead();
  ASSERT_TRUE(old->begin(1, to_proto(small_world())).ok());
  ASSERT_TRUE(old->append({stored_removal(1)}).ok());
  settle(*old);
  const auto store = lead();
  ASSERT_TRUE(old->append({stored_removal(66)}).ok());
  settle(*old);
  EXPECT_TRUE(old->lost());
  EXPECT_EQ(old->stored(), 1u);
  EXPECT_FALSE(old->begin(9, to_proto(small_world())).ok());
  EXPECT_FALSE(old->end().ok());
  ASSERT_TRUE(store->append({stored_removal(2)}).ok());
  settle(*store);
  EXPECT_THAT(ticks_of(lead()->take_stored()), ElementsAre(1, 2));
}

// Requests that are lost, answered by nobody, or come late: nothing that was told is lost or there twice.
TEST_F(EtcdStoreTest, WithAnyFaultsWhatWasToldIsThereOnce) {
  const auto seed = std::random_device()();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  Tick given = 0;
  Tick state = 0;
  Tick told = 0;
  auto store = lead();
  ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
  for (int round = 0; round < 400; ++round) {
    for (int n = 0; n < 3; ++n) etcd_.faults.push_back(static_cast<FakeEtcd::Fault>(random() % 4));
    switch (random() % 8) {
      case 0:
        if (store->change(state_of(given), store->position())) state = given;
        break;
      case 1: {
        etcd_.faults.clear();
        store = lead();
        ASSERT_TRUE(store);
        const auto world = store->take_stored();
        ASSERT_TRUE(world);
        const auto* chunks = std::get_if<SnapshotChunks>(&world->state);
        Tick tick = chunks != nullptr ? chunks->front().head().tick() : 0;
        ASSERT_LE(tick, state);
        for (const Tick next : ticks_of(world)) ASSERT_EQ(next, ++tick);
        ASSERT_GE(tick, told);
        given = tick;
        break;
      }
      default:
        ASSERT_TRUE(store->append({stored_removal(given + 1)}).ok());
        ++given;
    }
    for (std::uint32_t n = random() % 6; n > 0; --n) store->tend().IgnoreError();
    ASSERT_FALSE(store->lost());
    told = given - (store->position() - store->stored());
  }
}

}  // namespace
}  // namespace tessera
