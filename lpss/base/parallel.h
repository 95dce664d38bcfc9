// Loops over threads.
#pragma once

#include <absl/functional/function_ref.h>

#include <algorithm>
#include <cstddef>
#include <functional>

namespace tessera {

// Runs `body(0)` ... `body(count - 1)`, in any order, on any threads. The body may itself run loops.
using ParallelFor = std::function<void(std::size_t count, absl::FunctionRef<void(std::size_t)> body)>;

// Runs the loop on `parallel`, or here, one after the other, where that is empty or has one piece to do.
inline void run_parallel(const ParallelFor& parallel, std::size_t count,
                         absl::FunctionRef<void(std::size_t)> body) {
  if (parallel && count > 1) {
    parallel(count, body);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) body(i);
}

// A loop over many small items in pieces of `size` items; the last one may be shorter. The pieces do not
// depend on the number of threads.
class Pieces {
 public:
  Pieces(std::size_t items, std::size_t size)
      : items_(items), size_(size), count_((items + size - 1) / size) {}

  std::size_t count() const { return count_; }
  std::size_t begin(std::size_t piece) const { return piece * size_; }
  std::size_t end(std::size_t piece) const { return std::min(items_, begin(piece) + size_); }

 private:
  std::size_t items_;
  std::size_t size_;
  std::size_t count_;
};

// Of a loop over bodies.
inline constexpr std::size_t kBodiesInPiece = 256;

// Runs `act(0)` ... `act(items - 1)` in such pieces.
template <typename Act>
void run_in_pieces(const ParallelFor& parallel, std::size_t items, std::size_t size, const Act& act) {
  const Pieces pieces(items, size);
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) act(n);
  });
}

}  // namespace tessera
