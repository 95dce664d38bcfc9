#include "transport/host_lane.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <string>
#include <thread>

namespace tessera {
namespace {

constexpr Session kReader = 7;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

struct Lane {
  std::unique_ptr<LaneWriter> writer = LaneWriter::create();
  std::unique_ptr<LaneReader> reader = LaneReader::open(writer->offer(), kReader);
};

// The message number `n`, of a size and content that differ from those around.
std::string message(std::size_t n) {
  return std::string(n * 7919 % 3000, static_cast<char>('a' + n % 26)) + std::to_string(n);
}

TEST(HostLane, MessagesArriveInOrderManyTimesAroundTheRing) {
  Lane lane;
  ASSERT_TRUE(lane.reader);
  constexpr std::size_t kCount = 20'000;
  std::thread writing([&] {
    for (std::size_t n = 0; n < kCount; ++n) {
      while (!lane.writer->write(0, message(n))) std::this_thread::yield();
    }
  });
  for (std::size_t n = 0; n < kCount; ++n) {
    std::optional<std::string> got;
    while (!(got = lane.reader->read(0))) std::this_thread::yield();
    ASSERT_EQ(*got, message(n));
  }
  writing.join();
  EXPECT_FALSE(lane.reader->ready(kAll));
}

TEST(HostLane, AFullRingTakesNothingUntilSomethingIsRead) {
  Lane lane;
  const std::string large(kLaneMessageBytesMax, 'x');
  EXPECT_FALSE(lane.writer->write(0, large + "x"));
  std::size_t count = 0;
  while (lane.writer->write(0, large)) ++count;
  EXPECT_EQ(count, kLaneBytes / kLaneMessageBytesMax - 1);  // each has a heading
  EXPECT_EQ(lane.reader->read(0), large);
  EXPECT_TRUE(lane.writer->write(0, large));
  EXPECT_FALSE(lane.writer->write(0, large));
}

TEST(HostLane, AMessageWaitsForThePacketsBeforeIt) {
  Lane lane;
  ASSERT_TRUE(lane.writer->write(3, "after the third packet"));
  ASSERT_TRUE(lane.writer->write(3, ""));
  EXPECT_FALSE(lane.reader->read(2));
  EXPECT_EQ(lane.reader->read(3), "after the third packet");
  EXPECT_EQ(lane.reader->read(4), "");
  EXPECT_FALSE(lane.reader->read(kAll));
}

TEST(HostLane, ASleeperIsWokenOnce) {
  Lane lane;
  ASSERT_TRUE(lane.writer->write(0, "seen"));
  EXPECT_FALSE(lane.writer->take_asleep());
  lane.reader->sleep();
  ASSERT_TRUE(lane.writer->write(0, "to a sleeper"));
  EXPECT_TRUE(lane.writer->take_asleep());
  EXPECT_FALSE(lane.writer->take_asleep());
  lane.reader->sleep();
  lane.reader->stop_sleeping();
  EXPECT_FALSE(lane.writer->take_asleep());
}

TEST(HostLane, ServesOneProcessAndNoSuccessor) {
  const auto writer = LaneWriter::create();
  EXPECT_FALSE(writer->serves(kReader));
  EXPECT_FALSE(writer->serves(0));
  const auto reader = LaneReader::open(writer->offer(), kReader);
  ASSERT_TRUE(reader);
  EXPECT_TRUE(writer->serves(kReader));
  EXPECT_FALSE(writer->serves(kReader + 1));
  EXPECT_FALSE(LaneReader::open(writer->offer(), kReader + 1));
}

TEST(HostLane, IsReadAfterItsWriterHasEnded) {
  Lane lane;
  ASSERT_TRUE(lane.writer->write(0, "last words"));
  EXPECT_TRUE(lane.reader->has_writer());
  lane.writer.reset();
  EXPECT_FALSE(lane.reader->has_writer());
  EXPECT_EQ(lane.reader->read(0), "last words");
}

TEST(HostLane, AnOfferOfSomethingElseIsRefused) {
  const auto writer = LaneWriter::create();
  const LaneOffer good = writer->offer();
  EXPECT_FALSE(LaneReader::open({}, kReader));
  LaneOffer other = good;
  other.token[1] ^= 1;
  EXPECT_FALSE(LaneReader::open(other, kReader));
  other = good;
  other.process = -1;
  EXPECT_FALSE(LaneReader::open(other, kReader));
  other = good;
  other.descriptor = 0;  // standard input
  EXPECT_FALSE(LaneReader::open(other, kReader));

  // Memory of the right name and size that its owner could make smaller under the reader's feet.
  const int unsealed = ::memfd_create("tessera-lane", MFD_CLOEXEC);
  ASSERT_EQ(::ftruncate(unsealed, 2 << 20), 0);
  other = good;
  other.descriptor = unsealed;
  EXPECT_FALSE(LaneReader::open(other, kReader));
  ::close(unsealed);
  EXPECT_TRUE(LaneReader::open(good, kReader));
}

// What another process writes may be anything: neither end is led outside the ring.
TEST(HostLane, NonsenseInTheMemoryIsIgnored) {
  Lane lane;
  ASSERT_TRUE(lane.writer->write(0, "a message"));
  const std::string path = "/proc/self/fd/" + std::to_string(lane.writer->offer().descriptor);
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_GE(file, 0);
  const auto size = static_cast<std::size_t>(::lseek(file, 0, SEEK_END));
  auto* const bytes = static_cast<char*>(::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
  ASSERT_NE(bytes, MAP_FAILED);
  std::memset(bytes, 0xa5, size);
  EXPECT_FALSE(lane.reader->read(kAll));
  EXPECT_FALSE(lane.reader->ready(kAll));
  EXPECT_FALSE(lane.writer->write(0, "no room, as it seems"));
  ::munmap(bytes, size);
  ::close(file);
}

TEST(HostLane, CarriesBetweenProcesses) {
  const auto to = LaneWriter::create();
  const auto back = LaneWriter::create();
  const pid_t child = ::fork();
  if (child == 0) {
    const auto in = LaneReader::open(to->offer(), kReader);
    bool good = in != nullptr;
    for (int n = 0; good && n < 1000; ++n) {
      std::optional<std::string> got;
      while (!(got = in->read(0))) std::this_thread::yield();
      while (!back->write(0, *got + "!")) std::this_thread::yield();
    }
    ::_exit(good ? 0 : 1);
  }
  const auto from = LaneReader::open(back->offer(), kReader);
  ASSERT_TRUE(from);
  for (int n = 0; n < 1000; ++n) {
    ASSERT_TRUE(to->write(0, std::to_string(n)));
    std::optional<std::string> got;
    while (!(got = from->read(0))) std::this_thread::yield();
    ASSERT_EQ(*got, std::to_string(n) + "!");
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace tessera
