// What all experiments do with what they measured, and while they measure.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/terminal.h"
#include "experiments/common/report.h"

namespace tessera::cli {

// `measure(progress)` with a bar named `what`, until it ends or Ctrl-C is pressed.
template <typename Measure>
auto with_bar(const std::string& what, const Measure& measure) {
  std::unique_ptr<ProgressBar> bar;
  return measure([&](std::uint64_t done, std::uint64_t total) {
    if (!bar) bar = std::make_unique<ProgressBar>(what, total);
    bar->update(done);
    return !interrupted();
  });
}

// FILE itself for the main table, FILE_name.csv beside it for others.
std::filesystem::path beside(const std::filesystem::path& file, const std::string& name);

}  // namespace tessera::cli
