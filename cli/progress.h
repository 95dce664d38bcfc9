// Long work that tells how far it has come.
#pragma once

#include <cstdint>
#include <string>

#include "cli/interrupt.h"
#include "cli/terminal.h"

namespace tessera::cli {

// `work(progress)` with a bar named `what`, until it ends or Ctrl-C is pressed.
template <typename Work>
auto with_bar(const std::string& what, const Work& work) {
  ProgressBar bar(what, 0);
  return work([&](std::uint64_t done, std::uint64_t total) {
    bar.update(done, total);
    return !interrupted();
  });
}

}  // namespace tessera::cli
