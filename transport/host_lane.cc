#include "transport/host_lane.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <new>
#include <random>
#include <utility>

namespace tessera {

// Counters on cache lines of their own, each written by one side.
struct LaneMemory {
  std::array<std::uint64_t, 2> token = {};
  std::atomic<Session> reader = 0;
  alignas(64) std::atomic<std::uint64_t> head = 0;
  alignas(64) std::atomic<std::uint64_t> tail = 0;
  alignas(64) std::atomic<std::uint32_t> asleep = 0;
  alignas(64) std::array<char, kLaneBytes> ring;
};

namespace {

static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

constexpr const char* kMemoryName = "tessera-lane";
constexpr std::string_view kMemoryPath = "/memfd:tessera-lane";  // as the kernel shows it
// The memory keeps its size, whatever the other process does.
constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

// Before each message.
struct Heading {
  std::uint64_t after = 0;
  std::uint64_t bytes = 0;
};

MappedLane map_lane(int descriptor) {
  void* const memory = ::mmap(nullptr, sizeof(LaneMemory), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  return MappedLane(memory == MAP_FAILED ? nullptr : static_cast<LaneMemory*>(memory));
}

std::string path_of(const LaneOffer& offer) {
  return "/proc/" + std::to_string(offer.process) + "/fd/" + std::to_string(offer.descriptor);
}

// What a symbolic link of the kernel says; empty if it may not be read.
std::string link_target(const std::string& path) {
  std::array<char, 256> target;
  const ssize_t length = ::readlink(path.c_str(), target.data(), target.size());
  return length > 0 ? std::string(target.data(), length) : std::string();
}

// By name only, without opening it: what else is there is none of our business.
bool names_a_lane(const LaneOffer& offer) { return link_target(path_of(offer)).starts_with(kMemoryPath); }

// A process with a network of its own stands for another host, with everything that can happen between hosts.
bool shares_our_network(const LaneOffer& offer) {
  const std::string theirs = link_target("/proc/" + std::to_string(offer.process) + "/ns/net");
  return !theirs.empty() && theirs == link_target("/proc/self/ns/net");
}

std::uint64_t draw() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

}  // namespace

void LaneUnmapper::operator()(LaneMemory* memory) const { ::munmap(memory, sizeof(LaneMemory)); }

std::unique_ptr<LaneWriter> LaneWriter::create() {
  Descriptor descriptor(::memfd_create(kMemoryName, MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!descriptor.is_open() || ::ftruncate(descriptor.get(), sizeof(LaneMemory)) != 0 ||
      ::fcntl(descriptor.get(), F_ADD_SEALS, kSeals) != 0) {
    return nullptr;
  }
  MappedLane memory = map_lane(descriptor.get());
  if (!memory) return nullptr;
  // Without a value for the ring, whose pages come into being when they are written.
  new (memory.get()) LaneMemory;
  const LaneOffer offer{.process = ::getpid(), .descriptor = descriptor.get(), .token = {draw(), draw()}};
  memory->token = offer.token;
  return std::unique_ptr<LaneWriter>(new LaneWriter(std::move(memory), std::move(descriptor), offer));
}

bool LaneWriter::serves(Session reader) const {
  return reader != 0 && memory_->reader.load(std::memory_order_acquire) == reader;
}

bool LaneWriter::write(std::uint64_t after, std::string_view payload) {
  if (payload.size() > kLaneMessageBytesMax) return false;
  const std::uint64_t unread = head_ - memory_->tail.load(std::memory_order_acquire);
  const Heading heading{after, payload.size()};
  // A tail that no correct reader leaves is a ring without room.
  if (unread > kLaneBytes || kLaneBytes - unread < sizeof heading + payload.size()) return false;
  put(&heading, sizeof heading);
  put(payload.data(), payload.size());
  // In one order with the reader's word that it sleeps: one of the two sees the other's.
  memory_->head.store(head_, std::memory_order_seq_cst);
  return true;
}

void LaneWriter::put(const void* bytes, std::size_t size) {
  const std::size_t at = head_ % kLaneBytes;
  const std::size_t before_end = std::min(size, kLaneBytes - at);
  std::memcpy(memory_->ring.data() + at, bytes, before_end);
  std::memcpy(memory_->ring.data(), static_cast<const char*>(bytes) + before_end, size - before_end);
  head_ += size;
}

bool LaneWriter::take_asleep() {
  return memory_->asleep.load(std::memory_order_seq_cst) != 0 && memory_->asleep.exchange(0) != 0;
}

std::unique_ptr<LaneReader> LaneReader::open(const LaneOffer& offer, Session self) {
  if (offer.process <= 0 || !names_a_lane(offer) || !shares_our_network(offer)) return nullptr;
  const Descriptor descriptor(::open(path_of(offer).c_str(), O_RDWR | O_CLOEXEC));
  const int seals = !descriptor.is_open() ? -1 : ::fcntl(descriptor.get(), F_GET_SEALS);
  struct stat status {};
  if (seals < 0 || (seals & kSeals) != kSeals || ::fstat(descriptor.get(), &status) != 0 ||
      status.st_size != sizeof(LaneMemory)) {
    return nullptr;
  }
  MappedLane memory = map_lane(descriptor.get());
  if (!memory || memory->token != offer.token) return nullptr;
  Session nobody = 0;
  if (!memory->reader.compare_exchange_strong(nobody, self)) return nullptr;
  return std::unique_ptr<LaneReader>(new LaneReader(std::move(memory), offer));
}

bool LaneReader::ready(std::uint64_t received) {
  const std::uint64_t unread = memory_->head.load(std::memory_order_seq_cst) - tail_;
  if (unread == 0 || broken_) return false;
  Heading heading;
  if (unread >= sizeof heading && unread <= kLaneBytes) get(tail_, &heading, sizeof heading);
  if (unread < sizeof heading || unread > kLaneBytes || heading.bytes > unread - sizeof heading) {
    broken_ = true;
    std::fprintf(stderr,
                 "tessera: what process %lld writes into shared memory is ignored: it is no message\n",
                 static_cast<long long>(offer_.process));
    return false;
  }
  next_bytes_ = heading.bytes;
  return heading.after <= received;
}

std::optional<std::string> LaneReader::read(std::uint64_t received) {
  if (!ready(received)) return std::nullopt;
  std::string payload(next_bytes_, '\0');
  get(tail_ + sizeof(Heading), payload.data(), payload.size());
  tail_ += sizeof(Heading) + payload.size();
  memory_->tail.store(tail_, std::memory_order_release);
  return payload;
}

void LaneReader::get(std::uint64_t at, void* bytes, std::size_t size) const {
  const std::size_t begin = at % kLaneBytes;
  const std::size_t before_end = std::min(size, kLaneBytes - begin);
  std::memcpy(bytes, memory_->ring.data() + begin, before_end);
  std::memcpy(static_cast<char*>(bytes) + before_end, memory_->ring.data(), size - before_end);
}

void LaneReader::sleep() { memory_->asleep.store(1, std::memory_order_seq_cst); }
void LaneReader::stop_sleeping() { memory_->asleep.store(0, std::memory_order_relaxed); }

bool LaneReader::has_writer() const { return names_a_lane(offer_); }

}  // namespace tessera
