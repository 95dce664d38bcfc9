// Long work that tells how far it has come.
#pragma once

#include <cstdint>
#include <string>

#include "cli/interrupt.h"
#include "cli/measure/own_process.h"
#include "cli/terminal.h"

namespace tessera::cli {

// `work(progress)` with a bar named `what`, until it ends or Ctrl-C is pressed. `keep` hears what work has
// found until then.
template <typename Work>
auto with_bar(const std::string& what, const Work& work, const Keep& keep = {}) {
  ProgressBar bar(what, 0);
  return work([&](std::uint64_t done, std::uint64_t total, const Report& so_far) {
    if (keep) keep(so_far);
    bar.update(done, total);
    return !interrupted();
  });
}

}  // namespace tessera::cli
