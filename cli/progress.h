// Long work that tells how far it has come.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "cli/interrupt.h"
#include "cli/terminal.h"

namespace tessera::cli {

// `work(progress)` with a bar named `what`, until it ends or Ctrl-C is pressed.
template <typename Work>
auto with_bar(const std::string& what, const Work& work) {
  std::unique_ptr<ProgressBar> bar;
  return work([&](std::uint64_t done, std::uint64_t total) {
    if (!bar) bar = std::make_unique<ProgressBar>(what, total);
    bar->update(done);
    return !interrupted();
  });
}

}  // namespace tessera::cli
