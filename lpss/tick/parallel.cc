#include "lpss/tick/parallel.h"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#ifndef __SANITIZE_THREAD__
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace tessera {

#ifdef __SANITIZE_THREAD__

// The thread sanitizer cannot see how oneTBB orders what its threads do, since the distribution's is not
// built for it. With these, whose order it sees, it watches the bodies of the loops.
ParallelFor parallel_on(int threads) {
  if (threads <= 1) return {};
  return [threads](std::size_t count, absl::FunctionRef<void(std::size_t)> body) {
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
      for (std::size_t i = next++; i < count; i = next++) body(i);
    };
    std::vector<std::jthread> helpers;
    for (int helper = 1; helper < threads; ++helper) helpers.emplace_back(work);
    work();
  };
}

#else

ParallelFor parallel_on(int threads) {
  if (threads <= 1) return {};
  auto arena = std::make_shared<tbb::task_arena>(threads);
  return [arena](std::size_t count, absl::FunctionRef<void(std::size_t)> body) {
    arena->execute([&] {
      // Who waits for the pieces of a loop takes up none of another one.
      tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, count, 1),
            [&](const tbb::blocked_range<std::size_t>& range) {
              for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
            },
            tbb::simple_partitioner());
      });
    });
  };
}

#endif

}  // namespace tessera
