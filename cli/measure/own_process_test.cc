#include "cli/measure/own_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>

#include "cli/interrupt.h"

namespace tessera {
namespace {

TEST(OwnProcessTest, CarriesReportsAndErrorsAndOutlivesACrash) {
  absl::StatusOr<Report> report = in_own_process([]() -> absl::StatusOr<Report> {
    Report result;
    result.table("rows").push_back({{"figure", 0.1}, {"name", "a, b"}, {"none", nullptr}});
    result.misses = {"one"};
    return result;
  });
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->table("rows").front()["figure"], 0.1);
  EXPECT_EQ(report->misses.size(), 1u);
  const auto refused =
      in_own_process([]() -> absl::StatusOr<Report> { return absl::NotFoundError("no such world"); });
  EXPECT_EQ(refused.status(), absl::NotFoundError("no such world"));
  const auto crashed = in_own_process([]() -> absl::StatusOr<Report> { std::_Exit(3); });
  EXPECT_EQ(crashed.status().code(), absl::StatusCode::kInternal);
}

TEST(OwnProcessTest, EndsOneThatTakesMoreTimeThanItMay) {
  const auto endless = []() -> absl::StatusOr<Report> {
    volatile bool goes_on = true;
    while (goes_on) {
    }
    return Report();
  };
  EXPECT_EQ(in_own_process(endless, std::chrono::seconds(1)).status().code(), absl::StatusCode::kInternal);
}

void add_row(Report& report, int n) { report.table("rows").push_back({{"n", n}}); }

TEST(OwnProcessTest, KeepsWhatWasFoundUntilAnErrorOrACrash) {
  const auto failing = [](const Keep& keep) -> absl::StatusOr<Report> {
    Report report;
    keep(report);
    add_row(report, 1);
    keep(report);
    add_row(report, 2);
    keep(report);
    keep(report);
    add_row(report, 3);
    return absl::NotFoundError("no such world");
  };
  const Measured failed = in_own_process_keeping(failing);
  EXPECT_EQ(failed.status, absl::NotFoundError("no such world"));
  ASSERT_EQ(failed.report.rows(), 2u);
  EXPECT_EQ(failed.report.tables.front().rows.back()["n"], 2);
  const Measured crashed = in_own_process_keeping([&](const Keep& keep) -> absl::StatusOr<Report> {
    (void)failing(keep);
    std::_Exit(3);
  });
  EXPECT_EQ(crashed.status.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(crashed.report.rows(), 2u);
}

// It interrupts itself. Exits with 0 where what was kept until then is there.
[[noreturn]] void interrupt_oneself_with_a_row() {
  cli::catch_interrupts();
  const pid_t first = getpid();
  const Measured measured = in_own_process_keeping([&](const Keep& keep) -> absl::StatusOr<Report> {
    Report report;
    add_row(report, 1);
    keep(report);
    kill(first, SIGINT);
    while (true) pause();
  });
  const bool kept = absl::IsCancelled(measured.status) && measured.report.rows() == 1;
  std::_Exit(kept && cli::interrupting_signal() == SIGINT ? 0 : 1);
}

TEST(OwnProcessTest, KeepsWhatWasFoundUntilASignal) {
  EXPECT_EXIT(interrupt_oneself_with_a_row(), testing::ExitedWithCode(0), "");
}

// It interrupts itself. Exits with 0 where that ends the process of its own, and is told.
[[noreturn]] void interrupt_oneself() {
  cli::catch_interrupts();
  const pid_t first = getpid();
  const auto endless = [&]() -> absl::StatusOr<Report> {
    kill(first, SIGTERM);
    while (true) pause();
  };
  const auto nested = [&] { return in_own_process(endless); };
  const bool cancelled = in_own_process(nested).status().code() == absl::StatusCode::kCancelled;
  std::_Exit(cancelled && cli::interrupting_signal() == SIGTERM ? 0 : 1);
}

// In a process of its own: the tests that follow are not interrupted.
TEST(OwnProcessTest, EndsWithASignalToTheFirstProcess) {
  EXPECT_EXIT(interrupt_oneself(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace tessera
