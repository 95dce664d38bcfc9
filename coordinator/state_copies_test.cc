// States get from the folder of the coordinator that leads to those of its standbys.
#include "coordinator/state_copies.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>

#include "coordinator/test_cluster.h"
#include "coordinator/test_store.h"
#include "keys/gate.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"

namespace tessera {
namespace {

constexpr std::chrono::seconds kCopyPatience{60};

class StateCopiesTest : public ::testing::Test {
 protected:
  StateCopiesTest() : path_(::testing::TempDir() + "tessera_copies_" + std::to_string(getpid())) {
    std::filesystem::remove_all(path_);
    leading_ = *StateFolder::open(path_ / "leader");
    following_ = *StateFolder::open(path_ / "standby");
    copies_ = std::make_unique<StateCopies>(*leading_, [this] {
      const std::lock_guard lock(mutex_);
      ++changes_;
      changed_.notify_all();
    });
    serve(*copies_);
    copies_->lead(true);
  }
  ~StateCopiesTest() override {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
    std::filesystem::remove_all(path_);
  }

  void serve(grpc::Service& service, const std::optional<ServerKeys>& keys = std::nullopt) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", server_credentials(keys), &port);
    builder.RegisterService(&service);
    server_ = builder.BuildAndStart();
    address_ = "127.0.0.1:" + std::to_string(port);
  }

  // Waits for something to change, until `holds` holds.
  template <typename Condition>
  bool await(const Condition& holds) {
    std::unique_lock lock(mutex_);
    const auto deadline = std::chrono::steady_clock::now() + kCopyPatience;
    for (int seen = -1;; seen = changes_) {
      lock.unlock();
      if (holds()) return true;
      lock.lock();
      if (!changed_.wait_until(lock, deadline, [&] { return changes_ != seen; })) return false;
    }
  }
  bool await_holders(const std::string& name, std::size_t count) {
    return await([&] {
      const auto holders = copies_->holders(name);
      return holders && holders->size() == count;
    });
  }
  static std::string name(int number) {
    return "000000000000000a-" + std::string(15, '0') + std::to_string(number);
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  int changes_ = 0;
  std::filesystem::path path_;
  std::unique_ptr<StateFolder> leading_;
  std::unique_ptr<StateFolder> following_;
  std::unique_ptr<StateCopies> copies_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

TEST_F(StateCopiesTest, AStandbyGetsWhatIsRecordedAndWhatIsNext) {
  WorldDescription large = small_world();
  large.name = std::string(5 << 20, 'x');  // several pieces
  ASSERT_TRUE(leading_->write(name(1), to_proto(small_world())).ok());
  ASSERT_TRUE(leading_->write(name(2), to_proto(large)).ok());
  copies_->offer(name(1), name(2));
  EXPECT_EQ(copies_->holders(name(1)), std::vector<std::string>()) << "nobody is waited for";
  StateFollower follower(*following_);
  follower.follow(address_);
  ASSERT_TRUE(await_holders(name(2), 1));
  EXPECT_EQ(copies_->holders(name(1)), std::vector<std::string>{following_->coordinator()});
  const absl::StatusOr<StoredState> copy = following_->read(name(2));
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_EQ(std::get<v1::World>(*copy).name(), large.name);
  following_->drop_before(name(2));
  EXPECT_FALSE(following_->holds(name(1)));
  // One that has them gets only what is new.
  ASSERT_TRUE(leading_->write(name(3), to_proto(small_world())).ok());
  copies_->offer(name(2), name(3));
  EXPECT_TRUE(await_holders(name(3), 1));
}

// Of a state in several files, a standby gets those that it lacks, and counts as a holder with the last.
TEST_F(StateCopiesTest, AStandbyGetsTheFilesOfAState) {
  StateParts parts;
  const auto write = [&](int number, const StateChange& change) {
    const absl::Status written = leading_->write_change(parts.add(name(number), change), change);
    ASSERT_TRUE(written.ok()) << written;
  };
  StateChange whole = state_of(1);
  put(sector_chunk(5, std::string(100'000, 'a')), whole.chunks);
  write(1, whole);
  StateChange change = state_of(2);
  change.is_whole = false;
  write(2, change);
  EXPECT_EQ(leading_->files_of(name(2)), (std::vector<std::string>{name(1), name(2)}));
  copies_->offer(name(2), {});
  StateFollower follower(*following_);
  follower.follow(address_);
  ASSERT_TRUE(await_holders(name(2), 1));
  EXPECT_TRUE(following_->holds(name(2)));
  following_->drop_before(name(2));
  const absl::StatusOr<StoredState> copy = following_->read(name(2));
  ASSERT_TRUE(copy.ok()) << copy.status();
  EXPECT_EQ(std::get<SnapshotChunks>(*copy).size(), 3u);
  // Without one of its files a state is not held.
  const std::vector<std::string> files = following_->files_of(name(2));
  std::filesystem::remove(following_->path_of(files.front()));
  EXPECT_FALSE(following_->read(name(2)).ok());
  EXPECT_FALSE(following_->holds(name(2)));
}

TEST_F(StateCopiesTest, AStandbyThatIsGoneIsNotWaitedFor) {
  {
    StateFollower follower(*following_);
    follower.follow(address_);
    ASSERT_TRUE(leading_->write(name(1), to_proto(small_world())).ok());
    copies_->offer(name(1), {});
    ASSERT_TRUE(await_holders(name(1), 1));
  }
  EXPECT_TRUE(await_holders(name(2), 0));
}

TEST_F(StateCopiesTest, OneThatStandsByGivesNothing) {
  ASSERT_TRUE(leading_->write(name(1), to_proto(small_world())).ok());
  copies_->lead(false);
  const auto stub =
      v1::Coordination::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto stream = stub->CopyStates(&context);
  stream->Write(v1::StatesHeld());
  v1::StatePiece piece;
  EXPECT_FALSE(stream->Read(&piece));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(StateCopiesTest, WithKeysOnlyCoordinatorsGetStates) {
  const TestKeys keys;
  const auto daemon = *read_server_keys(keys.folder(), kDaemonFolder);
  server_->Shutdown(std::chrono::system_clock::now());
  serve(*copies_, daemon);
  ASSERT_TRUE(leading_->write(name(1), to_proto(small_world())).ok());
  copies_->offer(name(1), {});
  for (const auto& [client, refusal] : {std::pair("", grpc::StatusCode::UNAVAILABLE),
                                        std::pair("control", grpc::StatusCode::PERMISSION_DENIED)}) {
    const std::filesystem::path folder = *client == 0 ? std::filesystem::path() : keys.folder() / client;
    const auto stub =
        v1::Coordination::NewStub(ClientKeys::read(folder)->channel(address_, grpc::ChannelArguments()));
    grpc::ClientContext context;
    const auto stream = stub->CopyStates(&context);
    stream->Write(v1::StatesHeld());
    v1::StatePiece piece;
    EXPECT_FALSE(stream->Read(&piece));
    EXPECT_EQ(stream->Finish().error_code(), refusal) << client;
  }
  StateFollower follower(*following_, *ClientKeys::read(daemon.folder));
  follower.follow(address_);
  EXPECT_TRUE(await_holders(name(1), 1));
}

// A leader that names a file elsewhere.
class Forger final : public v1::Coordination::Service {
 public:
  grpc::Status CopyStates(grpc::ServerContext*,
                          grpc::ServerReaderWriter<v1::StatePiece, v1::StatesHeld>* stream) override {
    v1::StatesHeld held;
    if (!stream->Read(&held)) return grpc::Status::CANCELLED;
    v1::StatePiece piece;
    piece.set_name("../forged");
    piece.set_is_last(true);
    stream->Write(piece);
    has_been_left = !stream->Read(&held);
    return grpc::Status::OK;
  }
  std::atomic<bool> has_been_left = false;
};

TEST_F(StateCopiesTest, AStandbyWritesOnlyIntoItsFolder) {
  server_->Shutdown(std::chrono::system_clock::now());
  Forger forger;
  serve(forger);
  {
    StateFollower follower(*following_);
    follower.follow(address_);
    const auto deadline = std::chrono::steady_clock::now() + kCopyPatience;
    while (!forger.has_been_left && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  }
  EXPECT_TRUE(forger.has_been_left);
  EXPECT_FALSE(std::filesystem::exists(path_ / "forged.state"));
  server_->Shutdown(std::chrono::system_clock::now());
  server_.reset();
}

TEST(StateFolderTest, OneProcessHasItAndWhatIsDamagedIsNotHeld) {
  const std::filesystem::path path = ::testing::TempDir() + "tessera_states_" + std::to_string(getpid());
  std::filesystem::remove_all(path);
  std::string coordinator;
  {
    const auto folder = *StateFolder::open(path);
    coordinator = folder->coordinator();
    EXPECT_EQ(StateFolder::open(path).status().code(), absl::StatusCode::kAlreadyExists);
    ASSERT_TRUE(folder->write("1", to_proto(small_world())).ok());
  }
  const auto folder = *StateFolder::open(path);
  EXPECT_EQ(folder->coordinator(), coordinator);
  ASSERT_TRUE(folder->holds("1"));
  std::ofstream(path / "1.state", std::ios::app) << "x";
  EXPECT_EQ(folder->read("1").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(folder->holds("1"));
  std::filesystem::remove_all(path);
}

}  // namespace
}  // namespace tessera
