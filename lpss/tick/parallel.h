// Loops over threads.
#pragma once

#include <cstddef>
#include <functional>

namespace tessera {

// Runs `body(0)` ... `body(count - 1)`, in any order, on any threads.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

// A loop over `threads` threads of this process; threads >= 1. Empty for one: see run_parallel().
ParallelFor parallel_on(int threads);

// Runs the loop on `parallel`, or here, one after the other, where that is empty or has one piece to do.
void run_parallel(const ParallelFor& parallel, std::size_t count,
                  const std::function<void(std::size_t)>& body);

}  // namespace tessera
